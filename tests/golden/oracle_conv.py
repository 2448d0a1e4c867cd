# The second half of the oracle (oracle.py): networks with convolutions, pools, thresholds, gains, a softmax error and optimisers, in
# plain Python and numpy, written from the specification alone by someone who had not seen the Rust code. Whole small trainings.
# Run:  python3 oracle_conv.py > golden_conv.json        (asserts check the oracle itself)
# Other readings of a sentence that has two:  python3 oracle_conv.py FLAG[=VALUE] ...  (READINGS below)

import copy, hashlib, json, math, sys
from fractions import Fraction as Fr
import numpy as np
from oracle import (I64, NN, NP, PATH_NAMES, PN, PP, SITE_DITHER, SITE_INIT, Net, activity_codes, clamp_counted, data_codes,
                    draw_cells, gain_word, rsh, sat, shuffle_order, table_shift, tables, tap_table)

# Sentences of the specification that had two readings when this was written, and the one that the golden file has. Where the
# program took the other one at first sight, it says so.
READINGS = dict(
    pool_of="drives",              # a pool takes codes of drive_bits, or "activities" of 8 bits before them (first reading; MODEL 2.4 says codes)
    replay_moves="batch",          # thresholds and gains of a replay move once a batch, or after the write of each "sample" (MODEL 2.5)
    on_off="each",                 # full scale of the halves: each its own range, or that of the "data"
    nearest="ratio",               # the mantissa of rms nearest to a power: by their ratio, or by their "difference" (first reading)
    converters="layer",            # ranges of a net with thresholds or gains: layer by layer with those below, or of the "network" before any
                                   # (first reading; MODEL 2.5 says by layer)
    sign_words="separable",        # words of sign with separable dither: separable as any word of a cell, or its own "cell"'s (first reading)
)


def shift(v, s):
    """rsh of section 0 with both signs."""
    return rsh(v, s) if s >= 0 else v << -s


def ceil_log2(n):
    return (n - 1).bit_length()


def nearest(v):
    """floor(v + 1/2) of a real number that lies near no half."""
    assert abs(v - math.floor(v) - 0.5) > 1e-9, v
    return math.floor(v + 0.5)


def squares(v):
    """An exact sum of squares: a wide integer."""
    return sum(int(x) * int(x) for x in np.asarray(v).ravel())


# ---------------------------------------------------------------- data
DATA_NOTE = (
    "All integers non-negative, no wrap below 2^64. Example i, pixel (y, x) of height x width, channel c of `channels`, label = i % classes, full scale M: "
    "proto = (41*(y*(2*label + 1) + x*(label*label + 3) + c*(label + 2))) % (M+1); "
    "h = (i*2654435761 + ((y*width + x)*channels + c)*40503*(i+1)) >> 7; value = proto if h % 4 != 0, else (h >> 5) % (M+1). "
    "Values lie y, x, channel here, and plane by plane in the Rust test.")


def images(n, height, width, channels, classes, full_scale):
    m = full_scale + 1
    x = np.zeros((n, height, width, channels), I64)
    y = np.array([i % classes for i in range(n)])
    for i in range(n):
        for r in range(height):
            for q in range(width):
                for c in range(channels):
                    t = int(y[i])
                    proto = 41 * (r * (2 * t + 1) + q * (t * t + 3) + c * (t + 2)) % m
                    h = (i * 2654435761 + ((r * width + q) * channels + c) * 40503 * (i + 1)) >> 7
                    x[i, r, q, c] = proto if h % 4 != 0 else (h >> 5) % m
    return x, y


WHITE = """
-463 -658 -921 -648 -462 -718 -1626 -2793 -1613 -746 -1115 -2851 38415 -2846 -1117 -747 -1617 -2787 -1620 -743 -473 -653 -912 -653 -463
322 279 121 281 318 283 -322 -1272 -313 258 39 -1293 -3228 -1289 38 271 -297 -1250 -306 268 320 295 141 294 329
363 400 310 402 364 407 -21 -829 -15 392 222 -875 -2602 -859 238 390 -16 -818 -4 402 355 405 324 418 370
343 315 152 320 343 305 -319 -1328 -316 275 37 -1372 -3426 -1369 34 272 -333 -1347 -347 266 305 282 116 277 307
-478 -613 -842 -595 -467 -637 -1447 -2583 -1431 -657 -977 -2618 41325 -2607 -970 -663 -1430 -2566 -1441 -653 -511 -617 -845 -618 -487
361 321 168 335 377 305 -310 -1293 -303 292 43 -1344 -3347 -1331 55 300 -291 -1268 -294 311 369 344 188 347 387
353 407 328 420 362 409 -5 -802 0 402 219 -863 -2579 -852 232 392 -15 -821 -12 394 360 406 323 417 368
322 292 150 308 334 280 -293 -1203 -279 278 26 -1257 -3126 -1247 39 266 -279 -1197 -285 270 330 310 170 315 343
-573 -738 -971 -727 -568 -778 -1601 -2677 -1591 -793 -1137 -2743 38296 -2735 -1137 -795 -1585 -2661 -1591 -802 -570 -723 -947 -722 -567
"""
WHITE = np.array(WHITE.split(), I64).reshape(3, 3, 5, 5)      # [filter][colour][ky][kx]


def white(x, full_scale):
    """Six unsigned channels, 255 the full scale: on_0 on_1 on_2 off_0 off_1 off_2."""
    x = data_codes(x, full_scale, 8)
    n, height, width, channels = x.shape
    assert channels == 3
    size = height * width * 3
    out = np.zeros((n, height, width, 6), I64)
    for i in range(n):
        s1, s2 = int(x[i].sum()), squares(x[i])
        d = math.isqrt(size * s2 - s1 * s1) + 8 * size
        t = (256 * (size * x[i] - s1) + d) // (2 * d)
        wide = np.zeros((height + 4, width + 4, 3), I64)
        wide[2:-2, 2:-2] = t
        for o in range(3):
            f = np.zeros((height, width), I64)
            for ky in range(5):
                for kx in range(5):
                    f += wide[ky:ky + height, kx:kx + width] @ WHITE[o, :, ky, kx]
            out[i, :, :, o], out[i, :, :, 3 + o] = np.clip(rsh(f, 14), 0, 255), np.clip(rsh(-f, 14), 0, 255)
    return out, 255


def on_off(x, full_scale):
    """Twice the channels, on then off; the mean of a channel is rounded half up; 255 the full scale if each half has its own."""
    n = x[..., 0].size
    m = (2 * x.sum(axis=(0, 1, 2)) + n) // (2 * n)
    on, off = np.maximum(x - m, 0), np.maximum(m - x, 0)
    if READINGS["on_off"] == "data":
        return np.concatenate([on, off], axis=3), full_scale, m
    to_byte = lambda v, full: (2 * v * 255 + full) // np.maximum(2 * full, 1)
    return np.concatenate([to_byte(on, full_scale - m), to_byte(off, m)], axis=3), 255, m


# A pair of a single stream: the numbers of its pathways.
E, I = 0, 4


# ---------------------------------------------------------------- constants of a layer
def ramp_table(lut_bits):
    """Code 255 at three deviations of 2^(lut_bits - 3) indices: 10 bits give rsh(85 i, 7)."""
    i = np.arange(-(1 << (lut_bits - 1)), 1 << (lut_bits - 1), dtype=I64)
    a = np.clip(rsh(85 * i, lut_bits - 3), 0, 255)
    if lut_bits == 10:
        assert np.array_equal(a, np.clip((2 * 255 * i + 384) // 768, 0, 255)) and a[512 + 384] == 255 > a[512 + 383]
    return a, np.where((a > 0) & (a < 255), 255, 0)


def softmax_tables(weight_max, level_bits, drive_bits, temperature, ce):
    unit = Fr((1 << level_bits) * ((1 << drive_bits) - 1)) / Fr(weight_max) * Fr(temperature)
    esh = 0
    while (1 << (10 + esh)) < 8 * unit:
        esh += 1
    st = float(Fr(1 << esh) / unit)
    E = [nearest(2 ** 15 * math.exp(-i * st)) if i else 2 ** 15 for i in range(1023)] + [0]
    Q = [nearest(255 * math.exp(-i * st)) if i else 255 for i in range(1023)] + [0]
    G = [nearest(math.log(h / 32) / st) if h > 32 else 0 for h in range(32, 32 * ce + 1)]
    return esh, np.array(E, I64), np.array(Q, I64), np.array(G, I64)


def decay_at(decay, t, total):
    """f of section 3.5."""
    return {"constant": 1.0, "linear": 1 - t / total, "cosine": (1 + math.cos(math.pi * t / total)) / 2}[decay]


def power_table(f):
    """(m, s) with m 2^-s nearest to 2^(-f/256), m in 1..15."""
    if READINGS["nearest"] == "ratio":
        far = lambda m, s: abs(math.log2(m) - s + f / 256)
    else:
        far = lambda m, s: abs(m / 2 ** s - 2.0 ** (-f / 256))
    return min((far(m, s), s, m) for s in range(12) for m in range(1, 16))[:0:-1]


DEFAULTS = dict(
    seed=1, examples=40, height=6, width=6, channels=1, classes=4, full_scale=255, coding="raw", batch=8, epochs=2,
    level_bits=8, floor=0, ceiling=None, floor_kind="recoverable", drive_bits=8, dac_bits=8, tile_rows=128,
    adc="ideal", adc_bits=None, subtract="digital", adc_range=None, headroom=1, lut_bits=10, error_bits=8,
    error="one_vs_all", temperature=1, centre="batch", mode="accumulate", d_max=7, dither_bits=8, dither="per_cell", residual_bits=0,
    taps=1, tap_shift=None, decay="constant", rule="ed", layers=None)
# Of an array; `side` makes it a convolution of `units` channels.
ARRAY = dict(
    units=None, side=None, stride=1, border=0, pool=None, pool_side=2, act="sigmoid", alpha=4, weight_max=4, rate=20, mantissa=1,
    optimiser="plain", dead_zone=False, centred=False, threshold=False, gain="table", spread=0, window=9)
RECIPE = dict(act="ramp", threshold=True, gain="tracking", centred=True, optimiser="rms", rate=0.25)


class ConvNet(Net):
    def __init__(self, **over):
        s = dict(DEFAULTS)
        assert set(over) <= set(s), set(over) - set(s)
        s.update(over)
        s["ceiling"] = (1 << s["level_bits"]) - 1 if s["ceiling"] is None else s["ceiling"]
        s["tap_shift"] = (s["taps"] - 1).bit_length() if s["tap_shift"] is None else s["tap_shift"]
        self.s, self.nl = s, len(s["layers"])
        self.ns = -(-s["drive_bits"] // s["dac_bits"])
        self.softmax, self.back = s["error"] == "softmax", s["rule"] == "bp"
        assert not self.back or s["adc"] == "ideal"
        if self.back:
            self.names = {E: "e", I: "i"}
        self.raw, self.y = images(s["examples"], s["height"], s["width"], s["channels"], s["classes"], s["full_scale"])
        self.means_of_data = None
        if s["coding"] == "white":
            self.values, self.full = white(self.raw, s["full_scale"])
        elif s["coding"] == "on_off":
            self.values, self.full, self.means_of_data = on_off(self.raw, s["full_scale"])
        else:
            self.values, self.full = self.raw, s["full_scale"]
        self.x = data_codes(self.values, self.full, s["drive_bits"])
        self.alt_residual, self.alt_tap, self.first = True, False, None

        step = 1 if s["mode"] == "online" else s["batch"]
        self.updates = s["epochs"] * -(-s["examples"] // s["batch"])      # a shift is looked up once a batch, in every mode
        self.done = 0
        self.layers, self.paths, self.lsh, self.lut, self.taps, self.G, self.kstar = [], [], [], [], [], [], []
        self.level, self.rest, self.pruned, self.writes, self.counts, self.counts_free = {}, {}, {}, {}, {}, {}
        self.T, self.V, self.A, self.R, self.held = {}, {}, {}, {}, {}
        shape = self.x.shape[1:]                                          # the map below
        for l, given in enumerate(s["layers"]):
            a = {**ARRAY, **given}
            assert set(a) == set(ARRAY), set(given) - set(ARRAY)
            out = l == self.nl - 1
            if out:
                a["units"], a["act"] = s["classes"], "accumulator" if self.softmax else "sigmoid"
                assert not (a["side"] or a["threshold"] or a["pool"]) and a["gain"] == "table"
            assert (a["act"] == "ramp") == (a["gain"] != "table")
            a["below"] = list(shape)
            if a["side"]:
                h, w = ((d + 2 * a["border"] - a["side"]) // a["stride"] + 1 for d in shape[:2])
                a["fan_in"], a["map"] = a["side"] ** 2 * shape[2], [h, w, a["units"]]
                shape = (h // a["pool_side"], w // a["pool_side"], a["units"]) if a["pool"] else (h, w, a["units"])
                assert not a["pool"] or (h % a["pool_side"] == 0 and w % a["pool_side"] == 0)
            else:
                assert not a["pool"]
                a["fan_in"], a["map"] = int(np.prod(shape)), [1, 1, a["units"]]
                shape = (1, 1, a["units"])
            a["positions"] = P = a["map"][0] * a["map"][1]
            K, N = a["fan_in"], a["units"]
            self.layers.append(a)
            self.paths.append([E, I] if self.back else [PP, NP] if out else [PP, NP, NN, PN])
            lsh, unit = table_shift(a["act"], a["alpha"], a["weight_max"], s["level_bits"], s["drive_bits"], s["lut_bits"])
            self.lsh.append(lsh)
            self.lut.append(None if a["act"] == "accumulator" else ramp_table(s["lut_bits"]) if a["act"] == "ramp"
                            else tables(a["act"], a["alpha"], lsh, unit, s["lut_bits"]))
            self.kstar.append(self.shift_star(a, K))
            self.taps.append(tap_table(N, s["classes"], s["taps"]))
            self.G.append({})
            for p in self.paths[l]:
                gain = Fr(1) if out or self.back else (Fr(3, 2) if p in (PP, NN) else Fr(1, 2))
                self.G[l][self.names[p]] = G = gain_word(gain, s["level_bits"], a["weight_max"], K)
                u, r = (draw_cells(s["seed"], SITE_INIT, l, p, sub, 0, K, N, 2) for sub in (0, 1))
                self.level[l, p] = np.clip((u * G + (r << 16)) >> 32, s["floor"], s["ceiling"])
                self.rest[l, p], self.pruned[l, p], self.writes[l, p] = np.zeros((K, N), I64), np.zeros((K, N), bool), 0
                for counts in (self.counts, self.counts_free):
                    counts[l, p] = dict(requested=0, bounded=0, attempted=0, effective=0)
            if a["threshold"]:
                self.T[l] = {st: np.zeros(N, I64) for st in self.streams(l)}
            if a["gain"] == "tracking":
                self.V[l] = 0
            if a["centred"]:
                assert s["mode"] == "accumulate" and P * s["batch"] > 1
                self.A[l] = None                                          # of the first batch
            if a["optimiser"] == "rms":
                self.R[l], self.held[l] = None, 0
            if a["optimiser"] != "plain":
                assert s["mode"] == "accumulate" and a["mantissa"] == 1 and not (s["residual_bits"] and a["optimiser"] == "sign")
        self.widths = [a["fan_in"] for a in self.layers]
        if self.softmax:
            self.esh, self.E, self.Q, self.Gs = softmax_tables(self.layers[-1]["weight_max"], s["level_bits"], s["drive_bits"], s["temperature"], s["classes"])
        self.k = [self.shift_of(l) for l in range(self.nl)]
        for l, a in enumerate(self.layers):
            if a["optimiser"] != "rms":
                assert 0 <= nearest(self.kstar[l]) <= (16 if a["optimiser"] == "sign" else 30), (l, self.k[l])
        self.mu = np.zeros(s["classes"], I64)
        self.sat_train, self.events = self.new_sat(), {}
        self.calib_other, self.ash = None, []
        self.tracks = s["adc_range"] == "tracking"
        # converters of a net with thresholds or gains are fitted with what is calibrated below
        self.by_layer = (s["adc_range"] in ("tracking", "calibrated") and READINGS["converters"] == "layer"
                         and any(a["threshold"] or a["gain"] != "table" for a in self.layers))
        self.set_converters()
        self.forget_rails()
        self.unlooked = 0
        self.calibrate_homeostasis()

    # ---- shifts of rates
    def shift_star(self, a, K):
        """What a rate is before any decay: k of `plain` and `sign`, not rounded; log2 rho of `rms`."""
        s = self.s
        if a["optimiser"] == "sign":
            return -math.log2(a["rate"])
        if a["optimiser"] == "rms":
            return math.log2(a["rate"] * 2 ** s["level_bits"] / (a["weight_max"] * math.sqrt(K)))      # rho
        inv_peak = 2 * a["alpha"] if a["act"] == "sigmoid" else 1
        x = (Fr(a["rate"]) / (s["batch"] * a["positions"] * a["mantissa"]) * (1 << s["error_bits"])
             / (((1 << s["drive_bits"]) - 1) * ((1 << (s["error_bits"] - 1)) - 1) * 255 * Fr(inv_peak)) * (1 << s["level_bits"]) / Fr(a["weight_max"]))
        return -math.log2(x)

    def shift_of(self, l):
        """k of `plain` and `sign`, c of `rms`, at this update."""
        a, f = self.layers[l], decay_at(self.s["decay"], self.done, self.updates)
        if a["optimiser"] == "rms":
            n = a["fan_in"] * a["units"] * sum(p in (PP, NN) for p in self.paths[l])
            return nearest(256 * (math.log2(n) / 2 + self.kstar[l] + math.log2(f)))
        k = nearest(self.kstar[l] - math.log2(f))
        return k if a["optimiser"] == "sign" else min(k, 30)

    # ---- reading
    def reads(self, l, codes):
        """[sample * P + position, row] of the codes of the map below [sample, y, x, channel]."""
        a = self.layers[l]
        if not a["side"]:
            return codes.reshape(len(codes), -1)
        n, (h, w, _), b, side, stride = len(codes), a["map"], a["border"], a["side"], a["stride"]
        wide = np.zeros((n, codes.shape[1] + 2 * b, codes.shape[2] + 2 * b, codes.shape[3]), I64)
        wide[:, b:b + codes.shape[1], b:b + codes.shape[2]] = codes
        out = np.zeros((n, h, w, a["fan_in"]), I64)
        for y in range(h):
            for x in range(w):
                window = wide[:, y * stride:y * stride + side, x * stride:x * stride + side]
                out[:, y, x] = window.reshape(n, -1)                      # ky, kx, channel
        return out.reshape(n * h * w, -1)

    def pooled(self, l, codes):
        a, q = self.layers[l], self.layers[l]["pool_side"]
        n, h, w, c = codes.shape
        v = codes.reshape(n, h // q, q, w // q, q, c)
        if a["pool"] == "max":
            return v.max(axis=(2, 4))
        return (2 * v.sum(axis=(2, 4)) + q * q) // (2 * q * q)

    def event(self, what, count):
        self.events[what] = self.events.get(what, 0) + count

    def read_layer(self, l, maps, count, ideal):
        """Accumulators of a layer's streams, [read, unit], and the reads they are of."""
        if self.back:
            maps = {"p": maps["p"], "n": maps["p"]}       # one stream: n is looked at by nobody
        rec = {"map_p": maps["p"], "map_n": maps["n"], "xp": self.reads(l, maps["p"]), "xn": self.reads(l, maps["n"])}
        for st in self.streams(l):
            rec["acc_" + st] = self.accumulate(l, st, rec["xp"], rec["xn"], count, ideal)
        return rec

    def distances(self, l, st, acc):
        return acc - rsh(self.T[l][st], 8) if l in self.T else acc

    def look_up(self, l, rec, count):
        """Activities and slopes, and the map of the layer above."""
        a, s = self.layers[l], self.s
        half = 1 << (s["lut_bits"] - 1)
        train, maps = count is self.sat_train, {}
        for st in self.streams(l):
            acc = rec["acc_" + st]
            if train:
                tiles = -(-a["fan_in"] // s["tile_rows"])
                self.event("conversions", acc.size * tiles * self.ns * (1 if s["subtract"] == "current" and s["adc"] != "ideal" else 2))
            if a["act"] == "accumulator":
                rec["d_" + st] = np.full_like(acc, 255)
                continue
            idx, n = clamp_counted(shift(self.distances(l, st, acc), self.lsh[l]), -half, half - 1)
            count["table"][l] += n
            rec["i_" + st] = idx
            rec["a_" + st], rec["d_" + st] = self.lut[l][0][idx + half], self.lut[l][1][idx + half]
            if train:
                self.event("look_ups", acc.size)
                self.event("threshold_subtractions", acc.size * (l in self.T))
                self.event("statistic_adds", acc.size * ((l in self.T) + (l in self.V)))
                self.event("pooled", acc.size * bool(a["pool"]))
            m = rec["a_" + st].reshape([-1] + a["map"])
            if a["pool"] and READINGS["pool_of"] == "drives":
                maps[st] = self.pooled(l, activity_codes(m, s["drive_bits"]))
            else:
                maps[st] = activity_codes(self.pooled(l, m) if a["pool"] else m, s["drive_bits"])
        return maps

    def forward(self, codes, count, ideal=None):
        ideal = self.s["adc"] == "ideal" if ideal is None else ideal
        maps, out = {"p": codes, "n": codes}, []
        for l in range(self.nl):
            rec = self.read_layer(l, maps, count, ideal)
            maps = self.look_up(l, rec, count)
            out.append(rec)
        return out

    # ---- homeostasis
    def constant(self, l, factor, exponent):
        """A bound of the statistic of squares: the page's for 10 bits of index, scaled by 2^(2 (lut_bits - 10))."""
        streams = len(self.streams(l))
        return Fr(factor * streams * self.layers[l]["units"]) * Fr(2) ** (exponent + 2 * (self.s["lut_bits"] - 10))

    def calibrate_homeostasis(self):
        """Layer by layer upward, by the converters and with what is calibrated below."""
        count, codes = self.new_sat(), self.x[:256]
        maps = {"p": codes, "n": codes}
        self.lsh_before = list(self.lsh)
        for l in range(self.nl):
            a, streams = self.layers[l], self.streams(l)
            if self.by_layer:
                self.fit_converters(l, {"xp": self.reads(l, maps["p"]), "xn": self.reads(l, maps["n"])})
            rec = self.read_layer(l, maps, count, self.s["adc"] == "ideal")
            n = len(codes) * a["positions"]
            if l in self.T:
                for st in streams:
                    self.T[l][st] = (2 * (rec["acc_" + st].sum(axis=0) << 8) + n) // (2 * n)
            if a["gain"] != "table":
                z = sum(squares(self.distances(l, st, rec["acc_" + st])) for st in streams)
                lsh = -8
                while not z < n * self.constant(l, 1, 15 + 2 * lsh):
                    lsh += 1
                self.lsh[l] = lsh + (a["spread"] if a["gain"] == "fixed" else 0)
            maps = self.look_up(l, rec, count)
            if l in self.V:
                self.V[l] = (sum(squares(rec["i_" + st]) for st in streams) << 4) // len(codes) // a["positions"]

    def move(self, recs, samples):
        """Thresholds and gains, of these samples of a batch."""
        for l, a in enumerate(self.layers):
            P, n = a["positions"], len(samples) * a["positions"]
            w = a["window"] + ceil_log2(P)
            rows = np.concatenate([np.arange(b * P, (b + 1) * P) for b in samples])
            if l in self.V:
                z = sum(squares(recs[l]["i_" + st][rows]) for st in self.streams(l))
                self.V[l] += rsh((z << 4) - n * self.V[l], w)
                if self.V[l] >= self.constant(l, 1, 19):
                    self.lsh[l], self.V[l] = self.lsh[l] + 1, self.V[l] >> 2
                elif self.V[l] < self.constant(l, 3, 15):
                    self.lsh[l], self.V[l] = self.lsh[l] - 1, self.V[l] << 2
                assert -8 <= self.lsh[l] <= 47, "reaches an end"
            if l in self.T:
                for st in self.streams(l):
                    self.T[l][st] = self.T[l][st] + rsh((recs[l]["acc_" + st][rows].sum(axis=0) << 8) - n * self.T[l][st], w)

    # ---- errors and gates
    def told(self, rec):
        """What is compared with 255 at the label: activities, or softmax by look-up."""
        if not self.softmax:
            return rec["a_p"]
        acc = rec["acc_p"]
        self.event("softmax_look_ups", len(acc) * (2 * acc.shape[1] + 1))
        x = np.minimum(rsh(acc.max(axis=1, keepdims=True) - acc, self.esh), 1023)
        h = self.E[x].sum(axis=1, keepdims=True) >> 10
        assert h.min() >= 32
        return self.Q[np.minimum(x + self.Gs[h - 32], 1023)]

    def spread_words(self, recs, S):
        """Gates by read: a sample's word at each of its positions."""
        eb, out = self.s["error_bits"], []
        for l, a in enumerate(self.layers):
            u = {}
            for st in self.streams(l):
                if l == self.nl - 1:
                    err = S
                elif self.s["taps"] == 1:
                    err = S[:, [t[0] for t in self.taps[l]]] * (-1 if st == "n" else 1)
                else:
                    err, n = sat(rsh(sum(S[:, [t[i] for t in self.taps[l]]] for i in range(self.s["taps"])), self.s["tap_shift"]), eb)
                    self.sat_train["error_word"][l] += n if st == "p" else 0
                    err = -err if st == "n" else err
                err = np.repeat(err, a["positions"], axis=0)
                u[st], n = sat(rsh(err * recs[l]["d_" + st], eb), 8)
                self.event("multiplies", u[st].size)
                self.sat_train["gate"][l] += n
            out.append(u)
        return out

    # ---- back-propagation (section 3.8)
    def streams(self, l):
        return ["p"] if self.back else super().streams(l)

    def currents(self, l, stream, xp, xn):
        if not self.back:
            yield from super().currents(l, stream, xp, xn)
            return
        for sl in range(self.ns):
            pick = (xp >> (sl * self.s["dac_bits"])) & ((1 << self.s["dac_bits"]) - 1)
            yield sl, 0, pick @ self.level[l, E], pick @ self.level[l, I]

    def accumulate(self, l, stream, xp, xn, count, ideal):
        if not self.back:
            return super().accumulate(l, stream, xp, xn, count, ideal)
        if count is self.sat_train:
            self.event("shift_adds", len(xp) * self.layers[l]["units"] * -(-self.widths[l] // self.s["tile_rows"]) * self.ns * 2)
        return sum((e - i) << (sl * self.s["dac_bits"]) for sl, _, e, i in self.currents(l, stream, xp, xn))

    def read_back(self, l, u):
        """What a transposed read gives: a sum a code of the map below, [sample, y, x, channel], or a row of a dense layer."""
        a, d = self.layers[l], u @ (self.level[l, E] - self.level[l, I]).T
        self.event("conversions", d.size * 2 * 2 * self.ns)
        self.event("shift_adds", d.size * 2 * 2 * self.ns)
        if not a["side"]:
            return d
        (h, w, _), side, b = a["map"], a["side"], a["border"]
        height, width, channels = a["below"]
        out = np.zeros((len(d) // (h * w), height, width, channels), I64)
        d = d.reshape(len(out), h, w, side, side, channels)
        for y in range(h):
            for x in range(w):
                for ky in range(side):
                    for kx in range(side):
                        py, px = y * a["stride"] + ky - b, x * a["stride"] + kx - b
                        if 0 <= py < height and 0 <= px < width:
                            out[:, py, px] += d[:, y, x, ky, kx]
                            self.event("shift_adds", d[:, y, x, ky, kx].size)
        return out

    def heard(self, l, rec, words):
        """Words of the pixels behind a pool, [sample, y, x, unit], as positions hear them: [read, unit]."""
        a = self.layers[l]
        q, (h, w, n) = a["pool_side"] if a["pool"] else 1, a["map"]
        words = words.reshape(-1, h // q, w // q, n)
        if a["pool"] != "max":
            return words.repeat(q, axis=1).repeat(q, axis=2).reshape(-1, n)
        codes, out = activity_codes(rec["a_p"], self.s["drive_bits"]).reshape(-1, h, w, n), np.zeros((len(words), h, w, n), I64)
        for i, y, x, j in np.ndindex(words.shape):
            box = [(int(codes[i, y * q + v, x * q + c, j]), -v, -c) for v in range(q) for c in range(q)]
            _, v, c = max(box)                            # the first of the greatest: y, then x
            out[i, y * q - v, x * q - c, j] = words[i, y, x, j]
        return out.reshape(-1, n)

    def words_back(self, recs, S):
        """Gates by read, from the outputs downward."""
        eb, out, err = self.s["error_bits"], [None] * self.nl, S
        for l in reversed(range(self.nl)):
            a = self.layers[l]
            u, n = sat(rsh(err * recs[l]["d_p"], eb), 8)
            self.event("multiplies", u.size)
            self.event("bus_words", S.size if l == self.nl - 1 else words.size)
            self.sat_train["gate"][l] += n
            out[l] = {"p": u}
            if l:
                sums, by = self.read_back(l, u), self.worth(l) + 8 - eb
                words, n = sat(rsh(sums, by) if by >= 0 else sums << -by, eb)
                self.sat_train["error_word"][l - 1] += n
                err = self.heard(l - 1, recs[l - 1], words)
        return out

    def worth(self, l):
        """Bits that a level, or a step of a ramp, of the layer read takes off its row sums."""
        a, s = self.layers[l], self.s
        if a["gain"] == "table":
            return s["level_bits"] - int(math.log2(a["weight_max"]))
        rows = a["below"][2] * a["stride"] ** 2 if a["side"] else a["fan_in"]
        g = 0
        while 4 ** g * a["units"] < rows:
            g += 1
        return s["lut_bits"] - 3 + self.lsh[l] - (s["drive_bits"] - 2) - g

    # ---- writes
    def requests(self, l, recs, u, samples):
        """By pathway: (sum that the optimiser sees, without the pathway's sign)."""
        a, P, out = self.layers[l], self.layers[l]["positions"], {}
        rows = np.concatenate([np.arange(b * P, (b + 1) * P) for b in samples])
        for p in self.paths[l]:
            source, target = "p" if p in (PP, PN, I) else "n", "p" if p in (PP, NP, I) else "n"
            g = u[l][target][rows]
            total = recs[l]["x" + source][rows].T @ g
            self.event("accumulates", total.size * len(rows))
            if a["centred"]:
                A = self.A[l][source]
                by_row = np.tile(A, a["side"] ** 2) if a["side"] else A   # row (ky*side + kx)*channels + channel
                total = (total << 4) - by_row[:, None] * g.sum(axis=0)[None, :]
            out[p] = total
        return out

    def row_means(self, l, recs, first):
        """A of a row or, in a convolution, of a channel of the map below, border not counted."""
        a = self.layers[l]
        for st in "p" if self.back else "pn":
            m = recs[l]["map_" + st]
            b = len(m)
            m = m.reshape(b, -1, m.shape[3]) if a["side"] else m.reshape(b, 1, -1)
            pixels = m.shape[1]
            n, total = b * pixels, m.sum(axis=(0, 1)) << 4
            if first:
                self.A[l] = {**(self.A[l] or {}), st: (2 * total + n) // (2 * n)}
            else:
                w = ceil_log2(self.s["batch"]) + 3 + ceil_log2(pixels)
                self.A[l][st] = self.A[l][st] + rsh(total - n * self.A[l][st], w)

    def write_layer(self, l, recs, u, samples):
        a = self.layers[l]
        first = a["centred"] and self.A[l] is None
        if first:
            self.row_means(l, recs, True)
        sums = self.requests(l, recs, u, samples)
        bits = 4 if a["centred"] else 0
        D, F = self.s["dither_bits"], self.s["residual_bits"]
        sign = lambda p: 1 if p in (PP, NN) else -1       # E is the number of PP
        pairs = int(self.back)                            # a pair moves by two cells
        if a["optimiser"] == "plain":
            for p, v in sums.items():
                self.program(l, p, self.stochastic(sign(p) * v * a["mantissa"], self.k[l] + bits + pairs - F, l, p))
        elif a["optimiser"] == "sign":
            t = 0
            if a["dead_zone"]:
                z, n = sum(squares(v) for v in sums.values()), sum(v.size for v in sums.values())
                while not z < n << (2 * t + 1):
                    t += 1
            for p, v in sums.items():
                self.program(l, p, self.signs(l, p, sign(p) * v, t if a["dead_zone"] else None))
        else:
            z = sum(squares(v) for p, v in sums.items() if p in (PP, NN))
            if z:
                top = (z.bit_length() - 1) << 8
                self.R[l] = top if self.R[l] is None else self.R[l] + rsh(top - self.R[l], 4)
                X = ((self.R[l] + 128) >> 1) - self.k[l]
                kept = min(max(X, 0), 256 * 31 - 1)
                self.held[l] += kept != X
                m, s = power_table(kept & 255)
            for p, v in sums.items():
                self.program(l, p, self.stochastic(sign(p) * v * m, (kept >> 8) + s + pairs - F, l, p) if z else np.zeros_like(v))
        if a["centred"] and not first:
            self.row_means(l, recs, False)

    def signs(self, l, p, v, t):
        K, N = v.shape
        seed, count, k = self.s["seed"], self.writes[l, p], self.k[l]
        if self.s["dither"] == "separable" and READINGS["sign_words"] == "separable":
            r = draw_cells(seed, SITE_DITHER, l, p, 1, count, K, 1, 2) ^ draw_cells(seed, SITE_DITHER, l, p, 2, count, N, 1, 2).T
        else:
            r = draw_cells(seed, SITE_DITHER, l, p, 0, count, K, N, 2)
        k += self.back                                    # both cells of a pair take it
        go = (r < (1 << (16 - k))) if k <= 16 else np.zeros_like(v, bool)
        if t is not None:
            go &= np.abs(v) >= 1 << t
        return np.where(go, np.sign(v), 0)

    def program(self, l, p, inc):
        self.event("delta_computations", inc.size)
        super().program(l, p, inc)

    # ---- a training
    def update(self, rows):
        """One batch, or one sample online."""
        recs = self.forward(self.x[rows], self.sat_train)
        S = self.error_words(self.told(recs[-1]), self.y[rows])
        if self.back:
            u = self.words_back(recs, S)
        else:
            self.event("bus_words", sum(len(rows) * self.s["classes"] * len(self.streams(l)) for l in range(self.nl)))
            u = self.spread_words(recs, S)
        if self.first is None:
            self.first = (recs, S, u)
        everyone = list(range(len(rows)))
        for part in [[i] for i in everyone] if self.s["mode"] == "replay" else [everyone]:
            for l in range(self.nl):
                self.write_layer(l, recs, u, part)
            if self.s["mode"] == "replay" and READINGS["replay_moves"] == "sample":
                self.move(recs, part)
        if self.s["mode"] != "replay" or READINGS["replay_moves"] == "batch":
            self.move(recs, everyone)
        self.unlooked += len(rows)
        if self.tracks and (self.s["mode"] != "online" or self.unlooked == 64):
            self.look()

    def epoch(self, e):
        n, B = self.s["examples"], self.s["batch"]
        order = shuffle_order(self.s["seed"], e, n)
        for b in range(0, n, B):
            self.k = [self.shift_of(l) for l in range(self.nl)]
            batch = order[b:b + B]
            for part in [[i] for i in batch] if self.s["mode"] == "online" else [batch]:
                self.update(np.array(part))
            self.done += 1

    # ---- what goes into the golden file
    def state(self):
        out = self.snapshot()
        del out["saturations_training_by_layer"]
        for d in out["pathways"].values():
            for key in ("first_row_head", "if_pruned_cells_are_not_counted", "pruned_sha256", "residuals_sha256", "on_floor"):
                d.pop(key, None)
        of = lambda l, d: [int(x) for st in self.streams(l) for x in d[l][st]]
        means = lambda l: None if self.A[l] is None else [int(x) for st in ("p", "n")[:2 if l and not self.back else 1] for x in self.A[l][st]]
        sections = {                                      # of the state hash, in the order of layers, by tag
            "2": [[-1 if self.R[l] is None else self.R[l], self.held[l]] for l in self.R],
            "5": [of(l, self.T) for l in self.T],
            "6": [[self.lsh[l], *([self.V[l]] if l in self.V else [])] for l, a in enumerate(self.layers) if a["gain"] != "table"],
            "7": [means(l) for l in self.A]}              # the first layer has one set for both streams
        return {**out, "sections": sections, "k": list(self.k),
                "events_training": {k: v for k, v in sorted(self.events.items())}}

    def predictions(self):
        acc = self.forward(self.x, self.new_sat())[-1]["acc_p"]
        return np.argmax(acc, axis=1), acc


def run_case(name, note, **over):
    net = ConvNet(**over)
    s = net.s
    res = {"name": name, "note": note,
           "settings": dict({k: v for k, v in s.items() if k != "layers"}, seed_decimal=str(s["seed"]), layers=net.layers,
                            means_of_data=None if net.means_of_data is None else net.means_of_data.tolist(),
                            k=net.k, lsh=net.lsh_before, esh=net.esh if net.softmax else None),
           "after_calibration": {**net.state(), "ash": copy.deepcopy(net.ash) or None}, "after_epoch": []}
    for e in range(s["epochs"]):
        net.epoch(e)
        pred, acc = net.predictions()
        res["after_epoch"].append({**net.state(), "predictions": pred.tolist(), "correct": int((pred == net.y).sum()),
                                   "output_accumulators_i64_le_sha256": hashlib.sha256(np.ascontiguousarray(acc).astype("<i8").tobytes()).hexdigest()})
    last = res["after_epoch"][-1]
    total = lambda key: sum(p[key] for p in last["pathways"].values())
    sys.stderr.write(f"{name:24s} k={net.k} lsh={net.lsh_before}->{net.lsh} correct={[e['correct'] for e in res['after_epoch']]}/{s['examples']} "
                     f"distinct={len(set(last['predictions']))} req={total('requested')} bnd={total('bounded')} eff={total('effective')} "
                     f"sat={last['saturations_training']} held={net.held} {net.ash or ''}\n")
    return res


def conv(units, side=3, **more):
    return dict(units=units, side=side, **more)


def dense(units, **more):
    return dict(units=units, **more)


def readout(**more):
    return more


SOFT = dict(centred=True, optimiser="rms", rate=0.25, weight_max=1)

CASES = [
    ("paper", "sigmoid everywhere, one-vs-all, no homeostasis: average pooling, a border, a short last batch",
     dict(seed=101, examples=44, layers=[conv(8, border=1, pool="average", alpha=3, rate=300), conv(12, border=1, pool="max", pool_side=3, alpha=3, rate=200), dense(17, alpha=6, rate=60), readout(alpha=6, rate=60)])),
    ("replay_stride_taps3", "strides, no border, max pooling, three taps, running centre, remainders, separable dither, tiles of 7 rows",
     dict(seed=102, height=8, width=8, channels=2, mode="replay", centre="running", taps=3, residual_bits=4, dither="separable", tile_rows=7, classes=5, examples=30,
          layers=[conv(9, stride=2, border=1, pool="max", alpha=3, rate=60), conv(10, side=2, alpha=3, rate=40), readout(alpha=6, rate=10)])),
    ("converters_digital", "6-bit converters that track, digital subtraction, slices of 3 bits, tiles of 16 rows; average pools of 3 x 3; batch centre",
     dict(seed=116, adc="finite", adc_bits=6, adc_range="tracking", dac_bits=3, tile_rows=16, channels=3, classes=5, epochs=3,
          layers=[conv(10, border=1, pool="average", pool_side=3, alpha=3, rate=200), conv(10, side=2, alpha=3, rate=100), dense(15, rate=40), readout(rate=40)])),
    ("converters_online", "5-bit converters of differences that track, online: a look every 64 samples; an absorbing floor, remainders, maps that are not square",
     dict(seed=117, height=6, width=8, channels=2, adc="finite", adc_bits=5, adc_range="tracking", subtract="current", dac_bits=4, tile_rows=10, mode="online", centre="running",
          floor_kind="absorbing", floor=3, residual_bits=2, examples=36, epochs=4, batch=6, layers=[conv(8, border=1, pool="max", alpha=3, rate=100), conv(8, side=2, stride=2, border=1, alpha=3, rate=60), readout(rate=20)])),
    ("pools_of_3_bits", "drives of 3 bits behind average and max pools, rms and sign, rectified units, 1-bit converters' slices, calibrated full range",
     dict(seed=118, drive_bits=3, dac_bits=1, adc="finite", adc_bits=8, adc_range="full", tile_rows=20, height=8, width=8, channels=2, examples=30, level_bits=5,
          layers=[conv(9, border=1, pool="average", act="relu", optimiser="rms", rate=0.3, weight_max=2), conv(9, border=1, pool="max", alpha=3, optimiser="sign", rate=0.3, dead_zone=True, weight_max=2), readout(optimiser="rms", rate=0.3)])),
    ("online_threshold", "online: thresholds before a sigmoid table, no centring, windows of 32 samples, decay",
     dict(seed=103, mode="online", centre="none", batch=5, examples=33, decay="linear", classes=3,
          layers=[conv(6, border=1, pool="average", alpha=3, threshold=True, window=5, rate=20), conv(7, side=2, alpha=3, threshold=True, window=6, rate=20), dense(9, threshold=True, rate=10), readout(rate=5)])),
    ("recipe_white", "the recipe: white input, ramp, thresholds, tracking gains, centred, softmax, rms, cosine, a short last batch",
     dict(seed=104, height=8, width=8, channels=3, coding="white", error="softmax", decay="cosine", examples=42, classes=10, epochs=3,
          layers=[conv(10, border=1, pool="average", weight_max=2, window=5, **RECIPE), conv(10, border=1, pool="average", weight_max=2, window=6, **RECIPE), dense(20, weight_max=1, window=5, **RECIPE), readout(**SOFT)])),
    ("white_of_16", "white input of a full scale of 16 and 5 bits of drives, a map that is not square",
     dict(seed=119, height=6, width=7, channels=3, full_scale=16, coding="white", drive_bits=5, error="softmax", classes=5, examples=30,
          layers=[conv(10, side=5, stride=2, border=2, weight_max=2, window=6, **RECIPE), readout(**SOFT)])),
    ("recipe_on_off_4bit", "the recipe of 4 bits: levels, drives and errors; on and off inputs, max pooling, remainders with rms",
     dict(seed=105, level_bits=4, drive_bits=4, error_bits=5, channels=2, coding="on_off", full_scale=16, error="softmax", residual_bits=3, classes=5, examples=35,
          layers=[conv(10, border=1, pool="max", weight_max=2, window=6, **RECIPE), conv(10, weight_max=1, window=6, **RECIPE), readout(**SOFT)])),
    ("fixed_gain_plain", "gains fixed at twice a deviation, centred plain updates, mantissas, linear decay, average pooling of 3-bit drives, 6-bit levels",
     dict(seed=106, temperature=2, level_bits=6, drive_bits=3, error="softmax", decay="linear", dither_bits=16, epochs=3,
          layers=[conv(8, border=1, pool="average", act="ramp", threshold=True, gain="fixed", spread=1, centred=True, rate=2, mantissa=3, window=7),
                  conv(8, border=1, act="ramp", threshold=True, gain="fixed", centred=True, rate=2, window=7), readout(centred=True, rate=1, mantissa=5, weight_max=2)])),
    ("sign_dead_zone", "2-bit levels, sign with a dead zone, centred, softmax, tracking gains",
     dict(seed=107, level_bits=2, error="softmax", examples=48, epochs=3,
          layers=[conv(8, border=1, pool="average", weight_max=1, window=5, **{**RECIPE, "optimiser": "sign", "dead_zone": True, "rate": 0.0625}),
                  conv(8, border=1, pool="average", pool_side=3, weight_max=1, window=5, **{**RECIPE, "optimiser": "sign", "dead_zone": True, "rate": 0.125}), readout(optimiser="sign", dead_zone=True, rate=0.25, centred=True, weight_max=1)])),
    ("sign_1bit", "1-bit levels, sign without a dead zone, not centred, thresholds before sigmoid tables, one-vs-all, separable dither, cosine",
     dict(seed=108, level_bits=1, dither="separable", decay="cosine", classes=3,
          layers=[conv(6, border=1, pool="max", alpha=3, weight_max=1, optimiser="sign", rate=0.06, threshold=True, window=6),
                  conv(6, alpha=3, weight_max=1, optimiser="sign", rate=0.06, threshold=True, window=6), readout(optimiser="sign", rate=0.06, alpha=6, weight_max=1)])),
    ("tracking_digital", "5-bit converters that track, digital subtraction, slices of 3 bits, tiles of 16 rows, the recipe",
     dict(seed=109, adc="finite", adc_bits=5, adc_range="tracking", dac_bits=3, tile_rows=16, channels=3, error="softmax", classes=5, epochs=3,
          layers=[conv(10, border=1, pool="average", weight_max=2, window=5, **RECIPE), conv(10, border=1, pool="average", pool_side=3, weight_max=2, window=5, **RECIPE), dense(15, weight_max=1, window=5, **RECIPE), readout(**SOFT)])),
    ("tracking_online", "6-bit converters of differences that track, online: thresholds and gains that move each sample, running centre, softmax, remainders",
     dict(seed=110, adc="finite", adc_bits=6, adc_range="tracking", subtract="current", dac_bits=4, tile_rows=10, mode="online", centre="running", error="softmax", residual_bits=2, examples=36, epochs=4, batch=6,
          layers=[conv(8, border=1, pool="max", act="ramp", threshold=True, gain="tracking", window=5, rate=4), conv(8, act="ramp", threshold=True, gain="tracking", window=6, rate=2), readout(rate=1, weight_max=2)])),
    ("replay_gain", "replay with thresholds and tracking gains, tables of 8 bits, windows of side 2 on maps that are not square, two taps, calibrated converters",
     dict(seed=111, height=6, width=8, channels=2, adc="finite", adc_bits=8, adc_range="calibrated", dac_bits=2, tile_rows=8, headroom=3, mode="replay", error="softmax", lut_bits=8, taps=2, examples=30, epochs=3,
          layers=[conv(8, side=3, border=1, pool="average", act="ramp", threshold=True, gain="tracking", window=5, rate=4), conv(8, side=2, stride=2, border=1, act="ramp", threshold=True, gain="tracking", window=5, rate=2), readout(rate=1, weight_max=2)])),
    ("gain_without_threshold", "tracking gains without thresholds, an absorbing floor, a window of levels, rectified convolution with a threshold, dither 0, tables of 12 bits",
     dict(seed=112, temperature=0.5, floor_kind="absorbing", floor=2, ceiling=120, dither_bits=0, lut_bits=12, error="softmax", d_max=3,
          layers=[conv(8, border=1, pool="max", act="ramp", gain="tracking", window=5, centred=True, optimiser="rms", rate=0.2), conv(8, border=1, act="relu", threshold=True, centred=True, rate=1, window=6), readout(**SOFT)])),
    ("dense_rms", "no convolution: rms, three taps, remainders, linear decay",
     dict(seed=114, taps=3, residual_bits=2, decay="linear", epochs=3, layers=[dense(13, alpha=6, optimiser="rms", rate=0.2), dense(11, alpha=4, optimiser="rms", rate=0.3, weight_max=2), readout(optimiser="rms", rate=0.4, alpha=6)])),
    ("dense_sign", "no convolution: sign with and without a dead zone, cosine, 3-bit levels",
     dict(seed=115, level_bits=3, decay="cosine", epochs=3, layers=[dense(13, alpha=6, optimiser="sign", rate=0.1, dead_zone=True), dense(11, alpha=4, optimiser="sign", rate=0.2), readout(optimiser="sign", dead_zone=True, rate=0.3, alpha=6)])),
    ("back_average", "back-propagation: average pools, borders, a dense layer below the outputs, one against all, tiles of 40 rows, a short last batch",
     dict(seed=120, rule="bp", tile_rows=40, examples=44, epochs=3, layers=[conv(8, border=1, pool="average", alpha=3, rate=600), conv(12, border=1, pool="average", pool_side=3, alpha=3, rate=600), dense(17, alpha=6, rate=600), readout(alpha=6, rate=200)])),
    ("back_max_stride", "back-propagation: a max pool of 3-bit codes, strides that leave columns out, windows of side 2, borders of 2, replay, remainders, running centre, maps that are not square",
     dict(seed=121, rule="bp", height=8, width=6, channels=2, drive_bits=3, dac_bits=2, mode="replay", centre="running", residual_bits=4, classes=5, examples=30, error_bits=6,
          layers=[conv(9, border=1, pool="max", alpha=3, rate=60), conv(12, side=2, stride=2, border=1, alpha=3, rate=60), conv(10, border=2, alpha=3, rate=40), readout(alpha=6, rate=20)])),
    ("back_recipe", "back-propagation through the recipe: white input, ramp, thresholds, tracking gains, centred, softmax, rms, cosine; average and max pools",
     dict(seed=122, rule="bp", height=8, width=8, channels=3, coding="white", error="softmax", decay="cosine", examples=42, classes=10, epochs=3,
          layers=[conv(10, border=1, pool="average", weight_max=2, window=5, **RECIPE), conv(10, border=1, pool="max", weight_max=2, window=6, **RECIPE), dense(20, weight_max=1, window=5, **RECIPE), readout(**SOFT)])),
    ("back_online", "back-propagation online: thresholds before sigmoid tables, 12-bit levels, a convolution below the outputs without a pool",
     dict(seed=123, rule="bp", level_bits=12, mode="online", centre="none", batch=5, examples=33, classes=3,
          layers=[conv(6, border=1, pool="average", alpha=3, threshold=True, window=5, rate=20), conv(7, side=2, alpha=3, threshold=True, window=6, rate=20), readout(rate=5)])),
    ("centred_one_vs_all", "centred by thresholds with one-vs-all errors; error words of 9 bits, rms in hidden layers and plain at the output; strides that leave columns out",
     dict(seed=113, height=8, width=8, error_bits=9, classes=4, centre="none",
          layers=[conv(12, stride=2, window=6, **RECIPE), dense(12, window=6, **RECIPE), readout(rate=5)])),
]


def check_itself():
    """The page's sentences once more, one number at a time, on a net of the list."""
    net = ConvNet(**CASES[1][2])
    codes = net.x[:3]
    for l, a in enumerate(net.layers[:2]):
        rec = net.read_layer(l, {"p": codes, "n": codes[::-1]}, net.new_sat(), True)
        g = np.arange(rec["xp"].shape[0] * a["units"], dtype=I64).reshape(-1, a["units"]) * 37 % 101 - 50
        sums = {p: np.zeros_like(net.level[l, p]) for p in (PP, NP)}
        (h, w, c), side, cin = a["map"], a["side"], a["below"][2]
        acc = np.zeros_like(rec["acc_p"])
        for i in range(3):
            for y in range(h):
                for x in range(w):
                    for ky in range(side):
                        for kx in range(side):
                            py, px = y * a["stride"] + ky - a["border"], x * a["stride"] + kx - a["border"]
                            if not (0 <= py < codes.shape[1] and 0 <= px < codes.shape[2]):
                                continue
                            for q in range(cin):
                                row, read = (ky * side + kx) * cin + q, i * h * w + y * w + x
                                xp, xn = int(codes[i, py, px, q]), int(codes[2 - i, py, px, q])
                                acc[read] += net.level[l, PP][row] * xp - net.level[l, NP][row] * xn
                                sums[PP][row] += xp * g[read]
                                sums[NP][row] += xn * g[read]
        assert np.array_equal(acc, rec["acc_p"])
        got = net.requests(l, [rec] * 2, [{"p": g, "n": g}] * 2, range(3))
        assert np.array_equal(got[PP], sums[PP]) and np.array_equal(got[NP], sums[NP])
        codes = np.minimum(np.abs(acc) >> 8, 255).reshape(3, h, w, c)
        q = a["pool_side"]
        for kind in ("max", "average") if a["pool"] else ():
            a["pool"] = kind
            for at in np.ndindex(3, h // q, w // q, c):
                box = [int(codes[at[0], at[1] * q + v, at[2] * q + u, at[3]]) for v in range(q) for u in range(q)]
                want = max(box) if kind == "max" else math.floor(Fr(sum(box), q * q) + Fr(1, 2))
                assert net.pooled(l, codes)[at] == want
        codes = net.pooled(l, codes) if a["pool"] else codes


if __name__ == "__main__":
    check_itself()
    for given in sys.argv[1:]:
        key, _, value = given.partition("=")
        assert key in READINGS, key
        READINGS[key] = value
    cases = [run_case(n, note, **over) for n, note, over in CASES]
    json.dump({"notes": {"data": DATA_NOTE, "readings": READINGS}, "cases": cases}, sys.stdout, separators=(",", ":"))
    print()
