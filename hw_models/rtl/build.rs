//! Verilates the tile for the feature `rtl`; without it, nothing.
//!
//! `ED_TILE_SV` names another source of the tile, such as one with a seeded fault.
#![cfg_attr(
    feature = "rtl",
    expect(clippy::disallowed_methods, reason = "a build script reads its environment")
)]

fn main() {
    println!("cargo::rerun-if-changed=hw_models/rtl/build.rs");
    #[cfg(feature = "rtl")]
    rtl::build();
}

#[cfg(feature = "rtl")]
mod rtl {
    use std::env;
    use std::path::{Path, PathBuf};
    use std::process::Command;

    /// Rows and columns of the models.
    const SIZES: [u32; 3] = [8, 16, 64];

    pub(super) fn build() {
        let here = Path::new("hw_models/rtl");
        println!("cargo::rerun-if-env-changed=ED_TILE_SV");
        println!("cargo::rerun-if-changed={}", here.display());
        let source = env::var("ED_TILE_SV").map_or_else(|_| here.join("ed_tile.sv"), PathBuf::from);
        println!("cargo::rerun-if-changed={}", source.display());

        let runtime = PathBuf::from(verilator_root()).join("include");
        let out = PathBuf::from(env::var("OUT_DIR").expect("cargo names a folder for results"));
        let mut build = cc::Build::new();
        build.cpp(true).std("gnu++17").warnings(false).flag("-pthread").opt_level(2);
        build.include(&runtime).include(runtime.join("vltstd"));
        build.files(["verilated.cpp", "verilated_threads.cpp"].map(|file| runtime.join(file)));
        for size in SIZES {
            let folder = out.join(format!("ed_tile_{size}"));
            let mut script = Command::new("bash");
            script.arg(here.join("verilate.sh")).arg(&source).arg(size.to_string()).arg(&folder);
            let status = script.status().expect("bash runs the script that calls verilator");
            assert!(status.success(), "verilator refuses {}", source.display());
            build.file(folder.join("ed_tile.cpp"));
        }
        build.compile("ed_tile");
    }

    /// Where Verilator keeps what its models run on.
    fn verilator_root() -> String {
        let answer = Command::new("verilator").args(["--getenv", "VERILATOR_ROOT"]).output();
        let Ok(answer) = answer else {
            panic!(
                "the feature `rtl` needs `verilator` (Debian, Ubuntu: apt-get install verilator)"
            )
        };
        assert!(answer.status.success(), "`verilator --getenv VERILATOR_ROOT` failed");
        String::from_utf8(answer.stdout).expect("a path in UTF-8").trim().to_owned()
    }
}
