//! Ranges of the converters of a layer's tiles, and the codes counted for them.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::TickLayer;

impl TickLayer {
    pub(in super::super) fn set_adc_shifts(&mut self, adc_shifts: &[Vec<u32>]) {
        self.adc_shifts = adc_shifts.to_vec();
        let each = self.grid[0] * self.grid[1];
        for (tile, tick) in self.tiles.iter_mut().enumerate() {
            let (target, _) = self.planes[tile / each];
            if let Some(shifts) = adc_shifts.get(target.index()) {
                tick.set_adc_shifts(shifts);
            }
        }
    }

    /// Takes the codes that tiles have seen; they count where `counted` says so and converters track.
    pub(in super::super) fn take_rails(&mut self, counted: bool) {
        for tile in 0..self.tiles.len() {
            let (target, _) = self.planes[self.plane(tile)];
            let seen = self.take_rails_of(tile);
            if let Some(rails) = self.rails.get_mut(target.index()).filter(|_| counted) {
                let both = rails.iter_mut().flatten().zip(seen.into_iter().flatten());
                both.for_each(|(sum, more)| *sum += more);
            }
        }
    }

    /// Ranges are looked at: a slice of which more than one code in 64 lay on the rail takes a greater step.
    pub(in super::super) fn look(&mut self) {
        let mut adc_shifts = self.adc_shifts.clone();
        for (shifts, rails) in adc_shifts.iter_mut().zip(&mut self.rails) {
            for (shift, [on_rail, codes]) in shifts.iter_mut().zip(rails) {
                if 64 * *on_rail > *codes {
                    *shift += 1;
                }
                (*on_rail, *codes) = (0, 0);
            }
        }
        self.set_adc_shifts(&adc_shifts);
    }
}
