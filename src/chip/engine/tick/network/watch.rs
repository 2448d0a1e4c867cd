//! Looking at a network while it plays: what each layer did when, and the registers of a tile.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::tile::Tile;
use super::layer::TickLayer;
use crate::chip::ledger::Part;

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

/// A part of a tile at work without a pause, on one thing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartSpan {
    /// Which layer.
    pub layer: usize,
    /// Which tile of it, counted plane by plane, row by row.
    pub tile: usize,
    /// Which part: it is at work as the ledger counts it.
    pub part: Part,
    /// Sample and slice that it works on, where there are such.
    pub on: [Option<usize>; 2],
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
    /// Parts at work that may go on, by layer and tile.
    open: Vec<Vec<Vec<PartSpan>>>,
    over: Vec<PartSpan>,
    tile: Option<(TileAt, Look)>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("spans", &self.spans).finish_non_exhaustive()
    }
}

impl Watch {
    /// `tiles`: how many each layer has.
    pub(super) fn keep_spans(&mut self, tiles: impl Iterator<Item = usize>) {
        self.spans = Some(vec![]);
        self.open = tiles.map(|tiles| vec![vec![]; tiles]).collect();
    }

    /// What the parts of a layer do in the cycle that begins.
    pub(super) fn parts(&mut self, clock: u64, layer: usize, tiles: &TickLayer) {
        if self.open.is_empty() {
            return;
        }
        tiles.doing().for_each(|(tile, part, on)| self.part(clock, [layer, tile], part, on));
    }

    /// What a part of a tile of a layer is at in the cycle that begins.
    pub(super) fn part(
        &mut self,
        clock: u64,
        [layer, tile]: [usize; 2],
        part: Part,
        on: [Option<usize>; 2],
    ) {
        let Some(open) = self.open.get_mut(layer).map(|tiles| &mut tiles[tile]) else { return };
        let same = |span: &&mut PartSpan| (span.part, span.on, span.end) == (part, on, clock);
        if let Some(span) = open.iter_mut().find(same) {
            span.end += 1;
        } else {
            self.over.extend(open.extract_if(.., |span| span.end < clock));
            open.push(PartSpan { layer, tile, part, on, start: clock, end: clock + 1 });
        }
    }

    pub(super) fn take_parts(&mut self) -> Vec<PartSpan> {
        let mut all = std::mem::take(&mut self.over);
        all.extend(self.open.iter_mut().flatten().flat_map(std::mem::take));
        all
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
