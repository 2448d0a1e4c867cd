//! The same network in plain 32-bit floats, as a reference for time: dual streams, error diffusion, levels at least 0.
//!
//! ```text
//! z_p = a_p W_pp - a_n W_np     z_n = a_n W_nn - a_p W_pn      a = 1 / (1 + exp(-z))
//! u_p = e a_p (1 - a_p)         u_n = -e a_n (1 - a_n)         e of unit j: error of output j mod outputs
//! W   = max( 0, W +- rate a^T u )                              the last layer has stream p alone
//! ```

use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, Zip};

use super::chance;

/// One target stream of a layer.
struct Target {
    /// Excitatory and inhibitory weights, `[inputs][units]`.
    weights: [Array2<f32>; 2],
    /// `[sample][units]`.
    activity: Array2<f32>,
    gates: Array2<f32>,
}

/// A network and room for one batch.
pub(super) struct FloatNet {
    /// Targets p and n of each layer; p alone in the last.
    layers: Vec<Vec<Target>>,
    /// Error of each output, `[sample][outputs]`.
    errors: Array2<f32>,
}

impl FloatNet {
    /// A network of random weights, input to output.
    pub(super) fn new(sizes: &[usize], batch: usize) -> Self {
        let last = sizes.len() - 2;
        let weights = |number: u64, inputs: usize, units: usize| {
            let bytes = chance::bytes(number, inputs * units);
            let scale = 2.0 / (255.0 * (inputs as f32).sqrt());
            Array2::from_shape_fn((inputs, units), |(i, j)| scale * f32::from(bytes[i * units + j]))
        };
        let target = |layer: usize, stream: u64| {
            let (inputs, units) = (sizes[layer], sizes[layer + 1]);
            let number = 4 * layer as u64 + 2 * stream;
            Target {
                weights: [number, number + 1].map(|number| weights(number, inputs, units)),
                activity: Array2::zeros((batch, units)),
                gates: Array2::zeros((batch, units)),
            }
        };
        let streams = |layer| 0..if layer == last { 1 } else { 2 };
        let layers = (0..=last).map(|l| streams(l).map(|s| target(l, s)).collect()).collect();
        Self { layers, errors: Array2::zeros((batch, sizes[last + 1])) }
    }

    /// One update from inputs (`[sample][inputs]`, 0 to 1) and targets (`[sample][outputs]`).
    pub(super) fn step(&mut self, inputs: &Array2<f32>, targets: &Array2<f32>, rate: f32) {
        for layer in 0..self.layers.len() {
            let (below, here) = self.layers.split_at_mut(layer);
            for (stream, target) in here[0].iter_mut().enumerate() {
                let [own, other] = sources(below, inputs, stream);
                let z = &mut target.activity;
                general_mat_mul(1.0, own, &target.weights[0], 0.0, z);
                general_mat_mul(-1.0, other, &target.weights[1], 1.0, z);
                z.mapv_inplace(|z| 1.0 / (1.0 + (-z).exp()));
            }
        }
        let outputs = &self.layers.last().expect("a network has layers")[0].activity;
        Zip::from(&mut self.errors).and(targets).and(outputs).for_each(|e, t, a| *e = t - a);
        let width = self.errors.ncols();
        for target in self.layers.iter_mut().flatten() {
            let samples = target.gates.rows_mut().into_iter().zip(target.activity.rows());
            for ((mut gates, activity), errors) in samples.zip(self.errors.rows()) {
                let errors = errors.as_slice().expect("rows lie together");
                for (unit, (gate, a)) in gates.iter_mut().zip(activity).enumerate() {
                    *gate = errors[unit % width] * a * (1.0 - a);
                }
            }
        }
        for layer in 0..self.layers.len() {
            let (below, here) = self.layers.split_at_mut(layer);
            for (stream, target) in here[0].iter_mut().enumerate() {
                // stream n hears the negated error
                let rate = if stream == 0 { rate } else { -rate };
                let sources = sources(below, inputs, stream);
                for ((weights, source), rate) in
                    target.weights.iter_mut().zip(sources).zip([rate, -rate])
                {
                    general_mat_mul(rate, &source.t(), &target.gates, 1.0, weights);
                    weights.mapv_inplace(|weight| weight.max(0.0));
                }
            }
        }
    }
}

/// What drives the excitatory and the inhibitory weights of a target stream.
fn sources<'a>(
    below: &'a [Vec<Target>],
    inputs: &'a Array2<f32>,
    stream: usize,
) -> [&'a Array2<f32>; 2] {
    match below.last() {
        None => [inputs; 2],
        Some(below) => [&below[stream].activity, &below[1 - stream].activity],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_float_net_learns_a_batch_and_its_weights_stay_at_or_above_0() {
        let inputs = Array2::from_shape_fn((4, 8), |(b, i)| if i % 4 == b { 1.0 } else { 0.0 });
        let targets = Array2::from_shape_fn((4, 2), |(b, o)| if b % 2 == o { 1.0 } else { 0.0 });
        let mut net = FloatNet::new(&[8, 16, 2], 4);
        let wrong = |net: &FloatNet| net.errors.iter().map(|e| e * e).sum::<f32>();
        net.step(&inputs, &targets, 0.5);
        let before = wrong(&net);
        (0..300).for_each(|_| net.step(&inputs, &targets, 0.5));
        assert!(wrong(&net) < 0.5 * before, "{} after {before}", wrong(&net));
        let mut weights = net.layers.iter().flatten().flat_map(|target| &target.weights);
        assert!(weights.all(|weights| weights.iter().all(|&weight| weight >= 0.0)));
        let gates = net.layers.iter().flatten().flat_map(|target| &target.gates);
        assert_eq!(gates.filter(|gate| gate.is_subnormal()).count(), 0, "tiny floats are slow");
    }
}
