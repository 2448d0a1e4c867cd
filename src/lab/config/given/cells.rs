//! What cells were given: device, faults, currents, memory.

use super::List;
use crate::chip::device::{
    Ageing, CellSpread, Conductance, DeviceSpec, Endurance, FaultMap, Faults, Leakage, Programming,
    PulseNoise, Reference, Wires, Worn,
};
use crate::lab::config::device::listed;
use crate::num::fixed::Millionths;
use crate::num::tables::{DriftRates, SpreadLaw};

impl List {
    pub(super) fn device(&mut self, device: &DeviceSpec) {
        let DeviceSpec { response, states, asymmetry, noise, write_noise, tries, spread } = device;
        let CellSpread { step_law, step, asymmetry: lean, ceiling, floor } = spread;
        // millionths, as integers
        let numbers: Vec<_> = response.numbers().iter().map(|n| n.0.to_string()).collect();
        let response = format!("{} {}", response.name(), numbers.join(" "));
        self.put("device.response", response);
        self.put("device.states", states);
        self.put("device.asymmetry", asymmetry.0);
        let noise = match *noise {
            PulseNoise::Off => "off".into(),
            PulseNoise::OfStep(share) => format!("of_step {}", share.0),
            PulseNoise::OfWindow(share) => format!("of_window {}", share.0),
        };
        self.put("device.noise", noise);
        self.put("device.write_noise", write_noise.0);
        self.put("device.tries", tries);
        let law = match step_law {
            SpreadLaw::Normal => "normal",
            SpreadLaw::LogNormal => "log_normal",
        };
        if step.0 != 0 {
            self.put("device.spread.step_law", law);
        }
        self.put("device.spread.step", step.0);
        self.put("device.spread.asymmetry", lean.0);
        self.put("device.spread.ceiling", ceiling.0);
        self.put("device.spread.floor", floor.0);
    }

    pub(super) fn faults(&mut self, faults: Faults, map: &FaultMap) {
        let Faults { floor, ceiling, any } = faults;
        self.put("faults.floor", floor.get());
        self.put("faults.ceiling", ceiling.get());
        self.put("faults.any", any.get());
        self.put("faults.map", listed(map));
    }

    pub(super) fn currents(&mut self, conductance: Option<Conductance>, wires: Option<Wires>) {
        let off = conductance.map(|of| match of.reference {
            Reference::None => of.least.to_string(),
            Reference::Column => format!("{} and a reference column", of.least),
        });
        self.put("conductance.least", off.unwrap_or_else(|| "0".into()));
        self.put("wires.segment", wires.map_or(0, |of| of.segment));
    }

    pub(super) fn loads(&mut self, programming: Option<Programming>) {
        let sigma = programming.map(|loads| loads.coefficients.map(|c| c.to_string()).join(" "));
        self.put("programming.sigma", sigma.unwrap_or_else(|| "none".into()));
    }

    pub(super) fn memory(
        &mut self,
        endurance: Option<Endurance>,
        leakage: Option<Leakage>,
        ageing: Option<Ageing>,
    ) {
        let endurance = endurance.map(|Endurance { pulses, spread, worn }| {
            let stays = match worn {
                Worn::Level => "level",
                Worn::Floor => "floor",
                Worn::Ceiling => "ceiling",
            };
            format!("{pulses} spread {} to {stays}", spread.0)
        });
        self.put("endurance", endurance.unwrap_or_else(|| "none".into()));
        let leakage = leakage.map(|Leakage { lost, every, rest, spread }| {
            format!("{lost} every {every} to {} spread {}", rest.0, spread.0)
        });
        self.put("leakage", leakage.unwrap_or_else(|| "none".into()));
        let ageing = ageing.map(|Ageing { rates, since, every }| {
            let numbers =
                |of: &[Millionths]| of.iter().map(|n| n.0.to_string()).collect::<Vec<_>>();
            let law = match rates {
                DriftRates::Power(both) => {
                    format!("power {}", numbers(both.as_flattened()).join(" "))
                }
                DriftRates::Log(both) => format!("log {}", numbers(&both).join(" ")),
            };
            format!("{law} since {since} every {every}")
        });
        self.put("ageing", ageing.unwrap_or_else(|| "none".into()));
    }
}
