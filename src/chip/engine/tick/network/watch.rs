//! Looking at a network while it plays: what each layer did when, and the registers of a tile.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::tile::Tile;
use super::layer::TickLayer;

/// One command of a layer, from the cycle in which it was first offered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Which layer; `None` is the error unit.
    pub layer: Option<usize>,
    /// Name of the instruction.
    pub name: &'static str,
    /// Which sample, if it is for one.
    pub sample: Option<usize>,
    /// First cycle.
    pub start: u64,
    /// Cycle after the last.
    pub end: u64,
}

/// Where a tile is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileAt {
    /// Layer.
    pub layer: usize,
    /// Target stream, in the order of the layer's streams.
    pub target: usize,
    /// Row of tiles.
    pub down: usize,
    /// Column of tiles.
    pub across: usize,
}

type Look = Box<dyn FnMut(u64, &Tile)>;

#[derive(Default)]
pub(super) struct Watch {
    spans: Option<Vec<Span>>,
    tile: Option<(TileAt, Look)>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("spans", &self.spans).finish_non_exhaustive()
    }
}

impl Watch {
    pub(super) fn keep_spans(&mut self) {
        self.spans = Some(vec![]);
    }

    pub(super) fn take_spans(&mut self) -> Vec<Span> {
        self.spans.as_mut().map(std::mem::take).unwrap_or_default()
    }

    pub(super) fn span(&mut self, span: Span) {
        if let Some(spans) = &mut self.spans {
            spans.push(span);
        }
    }

    pub(super) fn tile(&mut self, at: TileAt, look: Look) {
        self.tile = Some((at, look));
    }

    pub(super) fn look(&mut self, cycle: u64, layers: &[TickLayer]) {
        if let Some((at, look)) = &mut self.tile {
            let tile = layers.get(at.layer).and_then(|layer| layer.tile_at(at));
            if let Some(tile) = tile {
                look(cycle, tile);
            }
        }
    }
}
