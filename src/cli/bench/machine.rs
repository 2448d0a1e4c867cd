//! What the processor calls itself, and what it can do.

/// The processor's name for itself, or the kind of machine.
pub(super) fn brand() -> String {
    let own = own_brand();
    if own.is_empty() { std::env::consts::ARCH.into() } else { own }
}

#[cfg(target_arch = "x86_64")]
fn own_brand() -> String {
    use std::arch::x86_64::__cpuid;
    if __cpuid(0x8000_0000).eax < 0x8000_0004 {
        return String::new();
    }
    let words = (0x8000_0002..=0x8000_0004u32).map(__cpuid);
    let bytes: Vec<u8> = words
        .flat_map(|w| [w.eax, w.ebx, w.ecx, w.edx])
        .flat_map(u32::to_le_bytes)
        .take_while(|&byte| byte != 0)
        .collect();
    String::from_utf8_lossy(&bytes).trim().into()
}

#[cfg(not(target_arch = "x86_64"))]
fn own_brand() -> String {
    String::new()
}

/// Features of the processor that kernels, or the float reference, have a use for.
#[cfg(target_arch = "x86_64")]
pub(super) fn features() -> Vec<&'static str> {
    let all = [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
        ("avx512bw", is_x86_feature_detected!("avx512bw")),
        ("avx512vl", is_x86_feature_detected!("avx512vl")),
        ("avx512vnni", is_x86_feature_detected!("avx512vnni")),
        ("avx512vbmi", is_x86_feature_detected!("avx512vbmi")),
        ("amx-int8", crate::chip::crossbar::kernel::Amx::detect().is_some()),
    ];
    all.into_iter().filter_map(|(name, there)| there.then_some(name)).collect()
}

/// Features of the processor that kernels have a use for.
#[cfg(not(target_arch = "x86_64"))]
pub(super) fn features() -> Vec<&'static str> {
    Vec::new()
}
