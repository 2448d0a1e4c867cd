"""Mean response curves of presets of aihwkit, as its own tiles take pulses.

    python3 tests/golden/aihwkit_curves.py tests/golden/aihwkit_curves.csv        (aihwkit 1.1.0, PyTorch 2.10.0, NumPy 2)

Noise, spread between devices, leakage and write noise are set to 0; one cell is pulsed from its least weight upward until its
window is crossed about twice by steps of mean length, then as often downward. Writes a line a read, some 27 a preset
and polarity: `preset,pulse,polarity,weight`, the weight as a share of w_min to w_max, 7 decimals. Pulses are counted from 1 in
each direction; a line of pulse 0 has the weight before the first. `tests/it/measure.rs` reads it, and holds the hardware models
of `hw_models/devices` against it. Nothing here is shared with dalean.
"""

import sys
from pathlib import Path

import torch
from aihwkit.simulator.configs import SingleRPUConfig
from aihwkit.simulator.presets import devices
from aihwkit.simulator.tiles import AnalogTile

PRESETS = {
    "aihwkit_reram_es": devices.ReRamESPresetDevice,
    "aihwkit_reram_sb": devices.ReRamSBPresetDevice,
    "aihwkit_reram_array_om": devices.ReRamArrayOMPresetDevice,
    "aihwkit_reram_array_hfo2": devices.ReRamArrayHfO2PresetDevice,
    "aihwkit_capacitor": devices.CapacitorPresetDevice,
    "aihwkit_ecram_li": devices.EcRamPresetDevice,
    "aihwkit_ecram_mo": devices.EcRamMOPresetDevice,
    "aihwkit_gokmen_vlasov": devices.GokmenVlasovPresetDevice,
    "aihwkit_idealized": devices.IdealizedPresetDevice,
}
READS = 24


def plain(preset):
    """The device of a preset with nothing that varies, leaks or stands beside the weight."""
    device = preset()
    for name in list(vars(device)):
        if name.endswith(("_dtod", "_std")) or name in ("corrupt_devices_prob", "lifetime", "diffusion", "reset"):
            setattr(device, name, 0.0)
    return device


def curve(preset):
    """Pulses and weights, up and then down."""
    device = plain(preset)
    config = SingleRPUConfig(device=device)
    config.update.update_bl_management = False
    config.update.update_management = False
    config.update.desired_bl = 1
    config.forward.is_perfect = True
    tile = AnalogTile(1, 1, config)
    tile.set_learning_rate(1.0)
    low, high = device.w_min, device.w_max
    tile.set_weights(torch.full((1, 1), low))
    share = lambda: (float(tile.get_weights()[0][0, 0]) - low) / (high - low)
    pulses = round(2 * (high - low) / device.dw_min)
    stride = -(-pulses // READS)
    lines = []
    for polarity, sign in (("up", 1.0), ("down", -1.0)):
        lines.append((0, polarity, share()))
        for pulse in range(1, pulses + 1):
            tile.update(-torch.ones(1, 1), sign * torch.ones(1, 1))
            if pulse % stride == 0 or pulse in (1, 2, 3, pulses):
                lines.append((pulse, polarity, share()))
    return lines


def main():
    torch.manual_seed(1)
    out = ["preset,pulse,polarity,weight"]
    for name, preset in PRESETS.items():
        out += [f"{name},{pulse},{polarity},{weight:.7f}" for pulse, polarity, weight in curve(preset)]
    Path(sys.argv[1]).write_text("\n".join(out) + "\n")


main()
