"""The products of a dual-stream convolutional net in 32-bit floats, by hand in PyTorch, as a reference for time.

    python tests/bench/torch_conv.py [steps]

Net 3-64-128-256 (3 x 3, padding 1, mean of 2 x 2), dense 4096-1800-10, batches of 32, one thread, error diffusion without
autograd:

    z_p = x_p W_pp - x_n W_np      z_n = x_n W_nn - x_p W_pn        a = min(max(z, 0), 1),  a' = 1 where 0 < z < 1
    u_p = e a_p'                   u_n = -e a_n'                    e of unit j: error of output j mod 10, at every position
    W   = max(0, W + rate x u)     W_pp, W_nn;  - rate x u of W_np, W_pn

The two arrays that a stream drives lie side by side, so that each stream is one product: the fastest way known here. Both
memory layouts of PyTorch are timed; the better one counts. Processor time of this process, best and median of the steps.
To hold it to AVX2: ATEN_CPU_CAPABILITY=avx2 ONEDNN_MAX_CPU_ISA=AVX2 MKL_ENABLE_INSTRUCTIONS=AVX2.
"""

import resource
import sys
import time

import torch
import torch.nn.functional as F

CHANNELS, HIDDEN, OUTPUTS, BATCH, RATE = [3, 64, 128, 256], 1800, 10, 32, 1e-5


def products():
    """Multiply-accumulates of an image: four arrays a layer, two in the last one, read and written."""
    total, side = 0, 32
    for below, units in zip(CHANNELS, CHANNELS[1:]):
        total += 4 * 9 * below * units * side * side
        side //= 2
    inputs = CHANNELS[-1] * side * side
    return 2 * (total + 4 * inputs * HIDDEN + 2 * HIDDEN * OUTPUTS)


class Net:
    def __init__(self, layout):
        make = lambda *shape: torch.rand(*shape) * 2 / (torch.tensor(shape[1:]).prod() ** 0.5)
        # what a stream drives: first the array of its own stream, then that of the other
        self.convs = []
        for below, units in zip(CHANNELS, CHANNELS[1:]):
            self.convs.append([make(2 * units, below, 3, 3).to(memory_format=layout) for _ in range(2)])
        inputs = CHANNELS[-1] * 16
        self.dense = [make(2 * HIDDEN, inputs).t().contiguous() for _ in range(2)]
        self.last = [make(OUTPUTS, HIDDEN).t().contiguous() for _ in range(2)]
        self.layout = layout

    def step(self, images, targets):
        xs, kept = [images, images], []
        for weights in self.convs:
            units = weights[0].shape[0] // 2
            p, n = (F.conv2d(x, w, padding=1) for x, w in zip(xs, weights))
            z = [p[:, :units] - n[:, units:], n[:, :units] - p[:, units:]]
            kept.append((xs, z))
            xs = [F.avg_pool2d(v.clamp(0, 1), 2) for v in z]
        flat = [x.reshape(BATCH, -1) for x in xs]
        p, n = (x @ w for x, w in zip(flat, self.dense))
        z = [p[:, :HIDDEN] - n[:, HIDDEN:], n[:, :HIDDEN] - p[:, HIDDEN:]]
        hidden = [v.clamp(0, 1) for v in z]
        out = hidden[0] @ self.last[0] - hidden[1] @ self.last[1]
        errors = targets - torch.softmax(out, 1)

        self.last[0].addmm_(hidden[0].t(), errors, alpha=RATE).clamp_(min=0)
        self.last[1].addmm_(hidden[1].t(), errors, alpha=-RATE).clamp_(min=0)
        route = torch.arange(HIDDEN) % OUTPUTS
        e = errors[:, route]
        u = [e * ((z[0] > 0) & (z[0] < 1)), -e * ((z[1] > 0) & (z[1] < 1))]
        for x, w, own, other in zip(flat, self.dense, u, u[::-1]):
            w.addmm_(x.t(), torch.cat([own, -other], 1), alpha=RATE).clamp_(min=0)
        for weights, (xs, z) in zip(self.convs, kept):
            units = weights[0].shape[0] // 2
            e = errors[:, torch.arange(units) % OUTPUTS][:, :, None, None]
            u = [e * ((z[0] > 0) & (z[0] < 1)), -e * ((z[1] > 0) & (z[1] < 1))]
            for x, w, own, other in zip(xs, weights, u, u[::-1]):
                both = torch.cat([own, -other], 1).contiguous(memory_format=self.layout)
                _, sums, _ = torch.ops.aten.convolution_backward(
                    both, x, w, None, [1, 1], [1, 1], [1, 1], False, [0, 0], 1, [False, True, False])
                w.add_(sums, alpha=RATE).clamp_(min=0)


def main():
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    torch.set_num_threads(1)
    torch.manual_seed(1)
    torch.set_flush_denormal(True)
    targets = F.one_hot(torch.arange(BATCH) % OUTPUTS, OUTPUTS).float()
    print(f"torch {torch.__version__}")
    for name, layout in [("nchw", torch.contiguous_format), ("nhwc", torch.channels_last)]:
        net = Net(layout)
        images = torch.rand(BATCH, 3, 32, 32).to(memory_format=layout)
        seconds = []
        with torch.no_grad():
            for _ in range(steps):
                start = time.process_time()
                net.step(images, targets)
                seconds.append(time.process_time() - start)
        seconds.sort()
        rate = products() * BATCH / seconds[0] / 1e9
        print(f"{name}: best {1e3 * seconds[0]:.1f} ms, median {1e3 * seconds[len(seconds) // 2]:.1f} ms a step; "
              f"{rate:.1f} GMAC/s at best; peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024} MiB")


main()
