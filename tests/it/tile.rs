//! The tile of docs/TILE.md alone: what it did when it agreed with the RTL is pinned.

use dalean::chip::engine::tick::Tile;

use crate::tile_program::{GOLDEN_CYCLES, Program, digest, numbers, pinned, settings};

/// The registers of the first cycles of every program have the digests that RTL and Tick agreed on.
#[test]
fn golden_digests_of_the_tile() {
    let mut moved = Vec::new();
    for setting in settings() {
        let mut tile = Tile::new(setting.tile_size(), setting.config.clone(), setting.table());
        let mut program = Program::new(&setting);
        let mut hasher = blake3::Hasher::new();
        for _ in 0..GOLDEN_CYCLES {
            program.prepare();
            let command = program.offer().map(|offer| offer.command());
            let accepted = command.as_ref().is_some_and(|command| tile.ready(command));
            tile.cycle(
                command.as_ref(),
                program.bus_word,
                [&program.dither[0], &program.dither[1]],
            );
            if accepted {
                program.accepted();
            }
            digest(&mut hasher, numbers(&tile).into_iter());
        }
        let found = pinned(&hasher);
        if found != setting.golden {
            moved.push(format!("{}: {found}, pinned is {}", setting.name, setting.golden));
        }
    }
    assert!(moved.is_empty(), "digests of registers moved:\n  {}", moved.join("\n  "));
}
