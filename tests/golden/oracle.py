# An independent check of the simulator's arithmetic: plain Python and numpy, written from DESIGN.md alone (sections 0 to 3 and
# the level part of the state hash of section 6) by someone who had not seen the Rust code. Both sides must give the same integers.
# Run:  python3 oracle.py > golden.json        (Python 3.11, numpy; about a quarter of a minute; asserts check the oracle itself)

import copy, hashlib, json, math, struct, sys
from decimal import Decimal, getcontext
from fractions import Fraction as Fr
import numpy as np

I64 = np.int64
PP, NP, NN, PN = 0, 1, 2, 3
PATH_NAMES = ["pp", "np", "nn", "pn"]
SITE_DITHER, SITE_INIT, SITE_SHUFFLE = 0, 1, 2
SAT_KINDS = ["conversion", "table", "error_word", "gate"]


# ---------------------------------------------------------------- section 0: integer conventions
def rsh(v, s):
    """(v + 2^(s-1)) >> s, halves toward +infinity; arithmetic shift (Python and numpy i64 both floor)."""
    assert s >= 0
    return v if s == 0 else (v + (1 << (s - 1))) >> s


def clamp_counted(v, lo, hi):
    """Clamped values and how many the clamp changed (reaching the rail is no saturation)."""
    out = np.clip(v, lo, hi)
    return out, int(np.count_nonzero(out != v))


def sat(v, n):
    top = (1 << (n - 1)) - 1
    return clamp_counted(np.asarray(v, I64), -top, top)


# ---------------------------------------------------------------- section 3: draws (ChaCha8 keyed by place)
def chacha_blocks(seed, stream, counters, rounds=8):
    """One row of 16 u32 words a counter. Words 4..11 key, 12,13 counter, 14,15 stream."""
    counters = np.asarray(counters, dtype=np.uint64)
    n = len(counters)
    low = np.uint64(0xFFFFFFFF)
    init = np.zeros((16, n), np.uint32)
    for w, c in enumerate((0x61707865, 0x3320646E, 0x79622D32, 0x6B206574)):
        init[w] = c
    init[4], init[5] = seed & 0xFFFFFFFF, seed >> 32
    init[12], init[13] = (counters & low).astype(np.uint32), (counters >> np.uint64(32)).astype(np.uint32)
    init[14], init[15] = stream & 0xFFFFFFFF, stream >> 32
    a, b, c, d = (init[4 * r:4 * r + 4].copy() for r in range(4))

    def rotl(x, r):
        return (x << np.uint32(r)) | (x >> np.uint32(32 - r))

    def quarter(a, b, c, d):
        a = a + b; d = rotl(d ^ a, 16)
        c = c + d; b = rotl(b ^ c, 12)
        a = a + b; d = rotl(d ^ a, 8)
        c = c + d; b = rotl(b ^ c, 7)
        return a, b, c, d

    for _ in range(rounds // 2):
        a, b, c, d = quarter(a, b, c, d)
        b, c, d = np.roll(b, -1, 0), np.roll(c, -2, 0), np.roll(d, -3, 0)
        a, b, c, d = quarter(a, b, c, d)
        b, c, d = np.roll(b, 1, 0), np.roll(c, 2, 0), np.roll(d, 3, 0)
    return (np.concatenate([a, b, c, d]) + init).T.copy()


def stream_id(site, layer=0, pathway=0, sub=0):
    return site << 56 | layer << 40 | pathway << 32 | sub


def draw_bytes(seed, site, layer, pathway, sub, count, nblocks):
    counters = [count << 28 | b for b in range(nblocks)]
    return chacha_blocks(seed, stream_id(site, layer, pathway, sub), counters).astype("<u4").tobytes()


def draw_cells(seed, site, layer, pathway, sub, count, rows, cols, w):
    """Words of w bytes for a logical array: cell (r, c) is word r % n of block c*ceil(rows/n) + r/n, n = 64/w."""
    n = 64 // w
    per_col = -(-rows // n)
    raw = draw_bytes(seed, site, layer, pathway, sub, count, cols * per_col)
    words = np.frombuffer(raw, dtype={1: "u1", 2: "<u2", 4: "<u4"}[w]).astype(I64)
    return words.reshape(cols, per_col * n)[:, :rows].T      # [row, col]


def shuffle_order(seed, epoch, n):
    raw = draw_bytes(seed, SITE_SHUFFLE, 0, 0, 0, epoch, -(-max(n - 1, 1) // 16))
    words = iter(np.frombuffer(raw, "<u4").tolist())
    order = list(range(n))
    for i in range(n - 1, 0, -1):
        k = (next(words) * (i + 1)) >> 32
        order[i], order[k] = order[k], order[i]
    return order


# ---------------------------------------------------------------- the synthetic data set
DATA_NOTE = (
    "All integers non-negative, no wrap below 2^64. Example i in 0..48, feature j in 0..70, label = i % C, full scale M = 16. "
    "proto = ((label*7919 + j*104729 + label*j*977) >> 3) % 17; h = (i*2654435761 + j*40503*(i+1)) >> 7; "
    "x = 0 if j == 0 or j == 69, else proto if h % 4 != 0, else (h >> 5) % 17. Rows are features in this order.")
N_EX, N_FEAT, FULL_SCALE = 48, 70, 16


def dataset(classes):
    x = np.zeros((N_EX, N_FEAT), I64)
    y = [i % classes for i in range(N_EX)]
    for i in range(N_EX):
        for j in range(1, N_FEAT - 1):
            proto = ((y[i] * 7919 + j * 104729 + y[i] * j * 977) >> 3) % 17
            h = (i * 2654435761 + j * 40503 * (i + 1)) >> 7
            x[i, j] = proto if h % 4 != 0 else (h >> 5) % 17
    return x, np.array(y)


def data_codes(x, full_scale, drive_bits):
    return (2 * x * ((1 << drive_bits) - 1) + full_scale) // (2 * full_scale)


def activity_codes(a, drive_bits):
    return np.minimum(rsh(a, 8 - drive_bits), (1 << drive_bits) - 1)


# ---------------------------------------------------------------- sections 1 to 3: constants of a layer
def gain_word(gain, level_bits, weight_max, fan_in):
    """floor(2^16 * gain * 2^level_bits / (weight_max * sqrt(fan_in)) + 1/2) by integer square root."""
    n = Fr(gain) * (1 << 16) * (1 << level_bits) / Fr(weight_max)
    four = 4 * n * n / fan_in
    twice = math.isqrt(four.numerator // four.denominator)    # floor(2x)
    return (twice + 1) // 2


def table_shift(act, alpha, weight_max, level_bits, drive_bits, lut_bits):
    z_range = 4 * Fr(alpha) if act == "sigmoid" else Fr(4)
    unit = Fr(weight_max) / ((1 << level_bits) * ((1 << drive_bits) - 1))
    lsh = 0
    while Fr(1 << (lut_bits - 1 + lsh)) * unit < z_range:
        lsh += 1
    return lsh, unit


def tables(act, alpha, lsh, unit, lut_bits):
    half = 1 << (lut_bits - 1)
    lut_a, lut_d = np.zeros(2 * half, I64), np.zeros(2 * half, I64)
    for i in range(-half, half):
        z = Fr(i) * (1 << lsh) * unit
        if act == "sigmoid":
            y = 1.0 / (1.0 + math.exp(-float(2 * z / Fr(alpha))))
            fa, fd = 255.0 * y, 255.0 * 4.0 * y * (1.0 - y)
            for f in (fa, fd):       # no entry so near a half that the last bit of exp could matter
                assert abs(f - math.floor(f) - 0.5) > 1e-9 or i == 0, (i, f)
            a, d = math.floor(fa + 0.5), math.floor(fd + 0.5)
        elif act == "relu":        # rational: no float is near
            a, d = math.floor(255 * max(z, Fr(0)) + Fr(1, 2)), 255 if z > 0 else 0
        else:
            a, d = math.floor(255 * z + Fr(1, 2)), 255
        lut_a[i + half], lut_d[i + half] = min(max(a, 0), 255), min(max(d, 0), 255)
    return lut_a, lut_d


def rate_shift(rate, batch, mantissa, eb, db, lb, weight_max, act, alpha):
    inv_peak = 2 * Fr(alpha) if act == "sigmoid" else Fr(1)
    x = (Fr(rate) / (batch * mantissa) * (1 << eb)
         / (((1 << db) - 1) * ((1 << (eb - 1)) - 1) * 255 * inv_peak) * (1 << lb) / Fr(weight_max))
    v = -math.log2(x)
    k = math.floor(v + 0.5)
    assert abs(v - math.floor(v) - 0.5) > 1e-9
    # exact: nearest integer means 2^-(k+1/2) < x < 2^-(k-1/2), squared to stay rational
    assert Fr(2) ** (-2 * k - 1) < x * x < Fr(2) ** (-2 * k + 1)
    assert 0 <= k <= 30, k          # others are refused
    return k


def tap_shifts(j, ce, taps):
    """The shifts of unit j; tap t hears word (j + shift) mod CE."""
    assert 1 <= taps <= min(4, ce)
    q, used = j // ce, [0]
    for t in range(1, taps):
        if t == 1:
            s = 1 + q % (ce - 1)
        else:
            free = [v for v in range(1, ce) if v not in used]
            s = free[(q // (ce - 1) ** (t - 1)) % len(free)]
        assert s not in used
        used.append(s)
    return used


def tap_table(units, ce, taps):
    return [[(j + s) % ce for s in tap_shifts(j, ce, taps)] for j in range(units)]


# ---------------------------------------------------------------- the network
DEFAULTS = dict(
    seed=1, hidden=[20], classes=10, act=None, alpha=None, weight_max=None, rate=None, batch=10, epochs=2,
    level_bits=8, floor=0, ceiling=None, floor_kind="recoverable", drive_bits=8, dac_bits=8, tile_rows=128,
    adc="ideal", adc_bits=None, subtract="digital", adc_range=None, headroom=1, lut_bits=10, error_bits=8,
    centre="batch", mode="accumulate", d_max=7, mantissa=1, dither_bits=8, dither="per_cell", residual_bits=0,
    taps=1, tap_shift=None)


class Net:
    def __init__(self, **over):
        s = dict(DEFAULTS)
        assert set(over) <= set(s), set(over) - set(s)
        s.update(over)
        widths = [N_FEAT] + s["hidden"] + [s["classes"]]
        nl = len(widths) - 1
        for key, value in (("alpha", 4), ("weight_max", 4), ("rate", 20), ("act", "sigmoid")):
            if not isinstance(s[key], list):
                s[key] = [value if s[key] is None else s[key]] * nl
        if s["ceiling"] is None:
            s["ceiling"] = (1 << s["level_bits"]) - 1
        if s["tap_shift"] is None:
            s["tap_shift"] = (s["taps"] - 1).bit_length()      # ceil(log2 T)
        assert 0 <= s["floor"] < s["ceiling"] <= (1 << s["level_bits"]) - 1
        self.s, self.widths, self.nl = s, widths, nl
        self.ns = -(-s["drive_bits"] // s["dac_bits"])
        self.raw, self.y = dataset(s["classes"])
        self.x = data_codes(self.raw, FULL_SCALE, s["drive_bits"])
        self.paths, self.G, self.k, self.lsh, self.lut, self.ash = [], [], [], [], [], []
        self.level, self.rest, self.pruned, self.writes, self.counts, self.counts_free = {}, {}, {}, {}, {}, {}
        for l in range(nl):
            out = l == nl - 1
            K, N = widths[l], widths[l + 1]
            al, wm, act = s["alpha"][l], s["weight_max"][l], s["act"][l]
            self.paths.append([PP, NP] if out else [PP, NP, NN, PN])
            self.k.append(rate_shift(s["rate"][l], s["batch"], s["mantissa"], s["error_bits"], s["drive_bits"],
                                     s["level_bits"], wm, act, al))
            lsh, unit = table_shift(act, al, wm, s["level_bits"], s["drive_bits"], s["lut_bits"])
            self.lsh.append(lsh)
            self.lut.append(tables(act, al, lsh, unit, s["lut_bits"]))
            self.G.append({})
            for p in self.paths[l]:
                gain = Fr(1) if out else (Fr(3, 2) if p in (PP, NN) else Fr(1, 2))
                G = gain_word(gain, s["level_bits"], wm, K)
                self.G[l][PATH_NAMES[p]] = G
                u = draw_cells(s["seed"], SITE_INIT, l, p, 0, 0, K, N, 2)
                r = draw_cells(s["seed"], SITE_INIT, l, p, 1, 0, K, N, 2)
                self.level[l, p] = np.clip((u * G + (r << 16)) >> 32, s["floor"], s["ceiling"])
                self.rest[l, p] = np.zeros((K, N), I64)
                self.pruned[l, p] = np.zeros((K, N), bool)
                self.writes[l, p] = 0
                self.counts[l, p] = dict(requested=0, bounded=0, attempted=0, effective=0)
                self.counts_free[l, p] = dict(requested=0, bounded=0, attempted=0, effective=0)
        self.mu = np.zeros(s["classes"], I64)
        self.sat_train = self.new_sat()
        self.taps = [tap_table(widths[l + 1], s["classes"], s["taps"]) for l in range(nl - 1)]
        # level and remainder are clamped as one number: the page's "no wind-up", of two readings
        self.alt_residual, self.alt_tap = True, False
        self.first = None
        self.calib_other = None
        self.tracks = s["adc_range"] == "tracking"
        self.set_converters()
        self.forget_rails()
        self.unlooked = 0

    names = PATH_NAMES

    def new_sat(self):
        return {kind: [0] * self.nl for kind in SAT_KINDS}

    # ---- section 2
    def streams(self, l):
        return ["p"] if l == self.nl - 1 else ["p", "n"]

    def currents(self, l, stream, xp, xn):
        """(slice, row tile, v_E, v_I), exact."""
        s = self.s
        (e, xe), (i, xi) = ((PP, xp), (NP, xn)) if stream == "p" else ((NN, xn), (PN, xp))
        for sl in range(self.ns):
            pick = lambda x: (x >> (sl * s["dac_bits"])) & ((1 << s["dac_bits"]) - 1)
            for r0 in range(0, self.widths[l], s["tile_rows"]):
                rows = slice(r0, r0 + s["tile_rows"])
                yield sl, r0, pick(xe)[:, rows] @ self.level[l, e][rows], pick(xi)[:, rows] @ self.level[l, i][rows]

    def forget_rails(self):
        """[codes on the rail, all codes] since the last look, by layer, stream and slice."""
        self.rails = [{st: [[0, 0] for _ in range(self.ns)] for st in self.streams(l)} for l in range(self.nl)]

    def look(self):
        """Tracking converters: more than 1 in 64 codes on the rail, and the shift grows by one."""
        for l in range(self.nl):
            for st in self.streams(l):
                for sl, (on, codes) in enumerate(self.rails[l][st]):
                    if 64 * on > codes:
                        self.ash[l][st][sl] += 1
        self.forget_rails()
        self.unlooked = 0

    def accumulate(self, l, stream, xp, xn, count, ideal):
        s, acc = self.s, 0
        rails = self.rails[l][stream] if not ideal and count is self.sat_train else [[0, 0] for _ in range(self.ns)]
        for sl, _, ve, vi in self.currents(l, stream, xp, xn):
            ash = 0 if ideal else self.ash[l][stream][sl]
            if ideal:
                d = ve - vi
            elif s["subtract"] == "digital":
                top = (1 << s["adc_bits"]) - 1
                ce, n1 = clamp_counted(rsh(ve, ash), 0, top)
                ci, n2 = clamp_counted(rsh(vi, ash), 0, top)
                count["conversion"][l] += n1 + n2
                rails[sl][0] += int(np.count_nonzero(ce == top)) + int(np.count_nonzero(ci == top))
                rails[sl][1] += ce.size + ci.size
                d = ce - ci
            else:
                half = 1 << (s["adc_bits"] - 1)
                d, n1 = clamp_counted(rsh(ve - vi, ash), -half, half - 1)
                count["conversion"][l] += n1
                rails[sl][0] += int(np.count_nonzero((d == half - 1) | (d == -half)))
                rails[sl][1] += d.size
            acc = acc + (d << (ash + sl * s["dac_bits"]))
        if ideal:       # the sliced, tiled sum is the whole product
            e, i = (PP, NP) if stream == "p" else (NN, PN)
            xe, xi = (xp, xn) if stream == "p" else (xn, xp)
            assert np.array_equal(acc, xe @ self.level[l, e] - xi @ self.level[l, i])
        return acc

    def forward(self, codes, count, ideal=None):
        """Per layer: drive codes read with, accumulators, activities and derivatives per stream."""
        ideal = self.s["adc"] == "ideal" if ideal is None else ideal
        half = 1 << (self.s["lut_bits"] - 1)
        xp = xn = codes
        out = []
        for l in range(self.nl):
            rec = {"xp": xp, "xn": xn}
            for st in self.streams(l):
                acc = self.accumulate(l, st, xp, xn, count, ideal)
                idx, n = clamp_counted(rsh(acc, self.lsh[l]), -half, half - 1)
                count["table"][l] += n
                rec["acc_" + st], rec["a_" + st] = acc, self.lut[l][0][idx + half]
                rec["d_" + st] = self.lut[l][1][idx + half]
            out.append(rec)
            if l < self.nl - 1:
                xp, xn = activity_codes(rec["a_p"], self.s["drive_bits"]), activity_codes(rec["a_n"], self.s["drive_bits"])
        return out

    def set_converters(self):
        s = self.s
        if s["adc"] == "ideal":
            return
        blank = lambda v: [{st: [v] * self.ns for st in self.streams(l)} for l in range(self.nl)]
        if isinstance(s["adc_range"], int):
            self.ash = blank(s["adc_range"])
        elif s["adc_range"] == "full":
            self.ash = blank(0)
            for l in range(self.nl):
                v = min(s["tile_rows"], self.widths[l]) * s["ceiling"] * ((1 << s["dac_bits"]) - 1)
                ash = 0
                while self.over(np.array([v, -v] if s["subtract"] == "current" else [v]), ash)[0]:
                    ash += 1
                for st in self.streams(l):
                    self.ash[l][st] = [ash] * self.ns
        else:
            assert s["adc_range"] == "calibrated" or (self.tracks and s["headroom"] == 1)
            self.ash, self.calib_other = blank(0), blank(0)
            recs = self.forward(self.x[:256], self.new_sat(), ideal=True)
            for l in range(self.nl):
                self.fit_converters(l, recs[l])

    def fit_converters(self, l, rec):
        """Shifts of a layer by what it reads here, and those by the other meaning of `on the rail`."""
        s = self.s
        for st in self.streams(l):
            seen = [[] for _ in range(self.ns)]
            for sl, _, ve, vi in self.currents(l, st, rec["xp"], rec["xn"]):
                seen[sl] += [ve.ravel(), vi.ravel()] if s["subtract"] == "digital" else [(ve - vi).ravel()]
            for sl in range(self.ns):
                v = np.concatenate(seen[sl])
                for which, table in ((1, self.ash), (0, self.calib_other)):
                    ash = 0
                    while self.over(v, ash)[which] * 1024 > len(v):
                        ash += 1
                    table[l][st][sl] = ash + s["headroom"]

    def over(self, v, ash):
        """(conversions the clamp changes, conversions whose code lies on a rail)."""
        code = rsh(v, ash)
        if self.s["subtract"] == "digital":
            lo, hi = None, (1 << self.s["adc_bits"]) - 1
            return int(np.count_nonzero(code > hi)), int(np.count_nonzero(code >= hi))
        half = 1 << (self.s["adc_bits"] - 1)
        return (int(np.count_nonzero((code > half - 1) | (code < -half))),
                int(np.count_nonzero((code >= half - 1) | (code <= -half))))

    # ---- section 3
    def error_words(self, a_p, labels):
        s, eb = self.s, self.s["error_bits"]
        e = -a_p.copy()
        e[np.arange(len(labels)), labels] += 255
        b = len(labels)
        if s["centre"] == "none":
            S, n = sat(rsh(e, 9 - eb), eb)
        elif s["centre"] == "batch":
            c = b * e - e.sum(axis=0)
            m = b * (1 << (9 - eb))
            S, n = sat((2 * c + m) // (2 * m), eb)       # floor division
        else:
            S, n = np.zeros_like(e), 0
            for i in range(b):                           # sample by sample, in batch order
                off = (e[i] << 8) - self.mu
                S[i], n1 = sat(rsh(off, 17 - eb), eb)
                self.mu = self.mu + rsh(off, 8)
                n += n1
        self.sat_train["error_word"][self.nl - 1] += n
        return S

    def gates(self, recs, S):
        eb, out = self.s["error_bits"], []
        for l in range(self.nl):
            u = {}
            for st in self.streams(l):
                if l == self.nl - 1:
                    err = S
                elif self.s["taps"] == 1:
                    err = S[:, [t[0] for t in self.taps[l]]]
                    err = -err if st == "n" else err
                else:
                    total = sum(S[:, [t[i] for t in self.taps[l]]] for i in range(self.s["taps"]))
                    if self.alt_tap and st == "n":
                        total = -total
                    err, n = sat(rsh(total, self.s["tap_shift"]), eb)
                    if st == "p":
                        self.sat_train["error_word"][l] += n
                    elif not self.alt_tap:
                        err = -err
                u[st], n = sat(rsh(err * recs[l]["d_" + st], eb), 8)
                self.sat_train["gate"][l] += n
                assert n == 0       # 127*255 >> 8 rounds to at most 127: this kind cannot occur
            out.append(u)
        return out

    def sums(self, l, p, rec, u, rows):
        a = rec["xp" if p in (PP, PN) else "xn"][rows]
        g = u["p" if p in (PP, NP) else "n"][rows]
        return (a.T @ g) * (1 if p in (PP, NN) else -1)

    def stochastic(self, v, k, l, p):
        D = self.s["dither_bits"]
        q = rsh(v, k - D) if k >= D else v << (D - k)
        if D == 0:
            return q
        K, N = v.shape
        w, seed, count = D // 8, self.s["seed"], self.writes[l, p]
        if self.s["dither"] == "per_cell":
            r = draw_cells(seed, SITE_DITHER, l, p, 0, count, K, N, w)
        else:
            r = (draw_cells(seed, SITE_DITHER, l, p, 1, count, K, 1, w)
                 ^ draw_cells(seed, SITE_DITHER, l, p, 2, count, N, 1, w).T)
        assert r.shape == v.shape and r.min() >= 0 and r.max() < 1 << D
        return (q + r) >> D

    def write(self, l, p, total):
        self.program(l, p, self.stochastic(total * self.s["mantissa"], self.k[l] - self.s["residual_bits"], l, p))

    def program(self, l, p, inc):
        s, F, dm = self.s, self.s["residual_bits"], self.s["d_max"]
        self.writes[l, p] += 1
        before, dead = self.level[l, p], self.pruned[l, p].copy()
        if F:
            t = self.rest[l, p] + inc
            inc = t >> F
        pulses = np.clip(inc, -dm, dm)
        after = np.clip(before + pulses, s["floor"], s["ceiling"])
        after[dead] = before[dead]
        if F:
            rest = t - (pulses << F)
            if self.alt_residual:       # level and remainder clamped as one number
                rest = np.where(before + pulses < s["floor"], 0, np.where(before + pulses > s["ceiling"], (1 << F) - 1, rest))
            self.rest[l, p] = np.clip(rest, 0, (1 << F) - 1)
        if s["floor_kind"] == "absorbing":
            self.pruned[l, p] = dead | ((pulses != 0) & (after == s["floor"]))
            assert (after[self.pruned[l, p]] == s["floor"]).all()
        self.level[l, p] = after
        for c, keep in ((self.counts[l, p], np.ones_like(dead)), (self.counts_free[l, p], ~dead)):
            c["requested"] += int(np.count_nonzero(inc[keep]))
            c["bounded"] += int(np.count_nonzero((inc != pulses)[keep]))
            c["attempted"] += int(np.abs(pulses[keep]).sum())
            c["effective"] += int(np.abs(after - before)[keep].sum())
        assert after.min() >= s["floor"] and after.max() <= s["ceiling"]
        assert (np.abs(after - before) <= np.abs(pulses)).all()

    def update(self, rows):
        """One batch; rows are example numbers in batch order."""
        recs = self.forward(self.x[rows], self.sat_train)
        S = self.error_words(recs[-1]["a_p"], self.y[rows])
        u = self.gates(recs, S)
        if self.first is None:
            self.first = {"example": int(rows[0]), "S": S[0].tolist()}
            for l in range(self.nl):
                for st in self.streams(l):
                    for key, v in (("acc_", recs[l]["acc_" + st]), ("a_", recs[l]["a_" + st]),
                                   ("u_", u[l][st])):
                        self.first[f"{key}{st}_layer{l}"] = v[0].tolist()
        one_by_one = [[i] for i in range(len(rows))] if self.s["mode"] == "replay" else [list(range(len(rows)))]
        for part in one_by_one:
            for l in range(self.nl):
                for p in self.paths[l]:
                    self.write(l, p, self.sums(l, p, recs[l], u[l], part))
        self.unlooked += len(rows)
        if self.tracks and (self.s["mode"] != "online" or self.unlooked == 64):
            self.look()

    def epoch(self, e):
        order = shuffle_order(self.s["seed"], e, N_EX)
        step = 1 if self.s["mode"] == "online" else self.s["batch"]
        assert not (step == 1 and self.s["centre"] == "batch")
        for b in range(0, N_EX, step):
            self.update(np.array(order[b:b + step]))

    # ---- what goes into the golden file
    def snapshot(self):
        s, out = self.s, {}
        sha = lambda b: hashlib.sha256(b).hexdigest()
        state = struct.pack("<I", 1)
        for l in range(self.nl):
            for p in self.paths[l]:
                lev = self.level[l, p]
                lb = np.ascontiguousarray(lev).astype("<u2").tobytes()
                d = {"levels_sha256": sha(lb), "level_sum": int(lev.sum()), "on_floor": int((lev == s["floor"]).sum()),
                     "first_row_head": lev[0, :8].tolist(), "writes": self.writes[l, p]}
                d.update(self.counts[l, p])
                state += struct.pack("<II", *lev.shape) + lb
                if s["floor_kind"] == "absorbing":
                    pr = self.pruned[l, p]
                    d["pruned_sha256"], d["pruned"] = sha(np.ascontiguousarray(pr).astype("u1").tobytes()), int(pr.sum())
                    d["if_pruned_cells_are_not_counted"] = dict(self.counts_free[l, p])
                    state += np.packbits(pr.ravel(), bitorder="little").tobytes()
                if s["residual_bits"]:
                    rb = np.ascontiguousarray(self.rest[l, p]).astype("<u2").tobytes()
                    d["residuals_sha256"], d["residual_sum"] = sha(rb), int(self.rest[l, p].sum())
                    state += rb
                assert d["effective"] <= d["attempted"] and d["bounded"] <= d["requested"] <= d["attempted"]
                out[f"layer{l}.{self.names[p]}"] = d
        shifts = {"ash": copy.deepcopy(self.ash)} if self.tracks else {}
        return {**shifts, "pathways": out, "state_level_part_sha256": sha(state), "mu": self.mu.tolist() if s["centre"] == "running" else None,
                "saturations_training": {k: sum(v) for k, v in self.sat_train.items()},
                "saturations_training_by_layer": {k: list(v) for k, v in self.sat_train.items()}}


def run_case(name, note, **over):
    net = Net(**over)
    settings = dict(net.s, seed_decimal=str(net.s["seed"]), widths=net.widths, features=N_FEAT, examples=N_EX, full_scale=FULL_SCALE, readout="p",
                    slices=net.ns, k=net.k, lsh=net.lsh, G=net.G, ash=copy.deepcopy(net.ash) or None)
    if net.calib_other is not None:
        settings["ash_if_on_the_rail_means_changed_by_the_clamp"] = net.calib_other
    res = {"name": name, "note": note, "settings": settings, "after_init": net.snapshot(), "after_epoch": []}
    for e in range(net.s["epochs"]):
        net.epoch(e)
        res["after_epoch"].append(net.snapshot())
    count = net.new_sat()
    acc = net.forward(net.x, count)[-1]["acc_p"]
    pred = np.argmax(acc, axis=1)                       # numpy takes the lowest index of equals
    res["first_example_of_first_batch"] = net.first
    res["prediction"] = {"classes": pred.tolist(), "correct": int((pred == net.y).sum()),
                         "output_accumulators_i64_le_sha256": hashlib.sha256(np.ascontiguousarray(acc).astype("<i8").tobytes()).hexdigest(),
                         "output_accumulators_of_example_0": acc[0].tolist(),
                         "saturations_evaluation": {k: sum(v) for k, v in count.items()}}
    alt = {}
    for flag, active in (("alt_residual", net.s["residual_bits"] > 0), ("alt_tap", net.s["taps"] > 1),
                         ("alt_rail", net.calib_other is not None)):
        if active:
            other = Net(**over)
            if flag == "alt_rail":
                other.ash = other.calib_other
            else:
                setattr(other, flag, flag != "alt_residual")  # the reading not taken
            for e in range(other.s["epochs"]):
                other.epoch(e)
            alt[flag] = other.snapshot()["state_level_part_sha256"]
    res["other_readings_state_level_part_sha256"] = alt
    last = res["after_epoch"][-1]
    sys.stderr.write(f"{name:28s} k={net.k} lsh={net.lsh} correct={res['prediction']['correct']:2d} distinct={len(set(pred.tolist()))} "
                     f"req={sum(p['requested'] for p in last['pathways'].values())} "
                     f"bnd={sum(p['bounded'] for p in last['pathways'].values())} "
                     f"eff={sum(p['effective'] for p in last['pathways'].values())} sat={last['saturations_training']} "
                     f"{net.ash if net.ash else ''} {'ALT-ASH' if net.calib_other not in (None, net.ash) else ''}\n")
    return res


CASES = [
    ("base", "one hidden layer, all defaults", {}),
    ("deep_separable", "two hidden layers, per-layer alpha, weight_max and rate, separable dither of 8 bits",
     dict(hidden=[40, 17], batch=16, alpha=[6, 4, 6], weight_max=[4, 2, 1], rate=[10, 5, 2.5], dither="separable", seed=2)),
    ("centre_none_c3", "three classes, no centring, 16-bit dither", dict(classes=3, centre="none", dither_bits=16, seed=3, batch=7, alpha=6, rate=4)),
    ("running_separable16", "running centre, separable 16-bit dither", dict(hidden=[40, 17], centre="running", dither_bits=16, dither="separable", rate=3, seed=4)),
    ("replay_batch", "replay, batch centre", dict(mode="replay", batch=16, alpha=[6, 4], rate=[20, 10], seed=5)),
    ("replay_running_taps3", "replay, running centre, three taps", dict(hidden=[40, 17], mode="replay", centre="running", taps=3, rate=5, seed=6)),
    ("online_running", "online, running centre, two hidden layers", dict(hidden=[40, 17], mode="online", centre="running", rate=2, seed=7)),
    ("online_none_d0", "online, no centring, half-up rounding, one pulse at most", dict(mode="online", centre="none", dither_bits=0, d_max=1, rate=[40, 20], seed=8)),
    ("taps3_deep", "three taps, batch centre", dict(hidden=[40, 17], taps=3, batch=16, rate=[20, 20, 5], seed=9)),
    ("taps2_replay_c3", "two taps of three words, replay, batch centre", dict(hidden=[40], classes=3, taps=2, mode="replay", rate=5, seed=28)),
    ("taps3_saturated", "three taps, tap_shift 0 so that tap sums saturate, no centring", dict(hidden=[40, 17], taps=3, tap_shift=0, centre="none", rate=4, seed=10)),
    ("taps4_shift1", "four taps, tap_shift 1", dict(hidden=[50], taps=4, tap_shift=1, seed=29)),
    ("residual_4bit", "4-bit levels with a residual of 4 bits, one pulse at most", dict(level_bits=4, residual_bits=4, rate=20, d_max=1, seed=11)),
    ("residual_replay_8bit", "8-bit levels, residual 4, replay, separable 16 bits", dict(residual_bits=4, mode="replay", dither="separable", dither_bits=16, rate=[40, 10], d_max=2, seed=12)),
    ("residual_d0_2bit", "2-bit levels, residual 4, half-up", dict(level_bits=2, residual_bits=4, dither_bits=0, rate=20, seed=13)),
    ("absorbing_4bit", "absorbing floor, 4-bit levels, replay", dict(level_bits=4, floor_kind="absorbing", mode="replay", rate=20, seed=14)),
    ("absorbing_window", "absorbing floor at 20 of window 20..90", dict(floor_kind="absorbing", floor=20, ceiling=90, rate=40, d_max=40, seed=15)),
    ("window", "recoverable floor, window 3..100, d_max 15", dict(floor=3, ceiling=100, rate=[40, 20, 10], d_max=15, hidden=[40, 17], seed=16)),
    ("levels2", "2-bit levels, large batch, 16-bit dither", dict(level_bits=2, batch=32, dither_bits=16, rate=60, seed=17)),
    ("levels12", "12-bit levels, mantissa 3, d_max 127", dict(level_bits=12, mantissa=3, d_max=127, hidden=[40, 17], dither_bits=16, rate=10, seed=18)),
    ("drive4_error4", "4-bit drives and errors, mantissa 15: the shift may lie below the dither width", dict(drive_bits=4, error_bits=4, rate=[60, 20, 5], mantissa=3, hidden=[40, 17], seed=19)),
    ("drive4_error4_fast", "4-bit drives and errors: shifts below the dither width", dict(drive_bits=4, error_bits=4, rate=40, seed=26)),
    ("relu_hidden", "ReLU in the hidden layer, sigmoid at the output", dict(act=["relu", "sigmoid"], alpha=4, weight_max=[2, 4], rate=[2, 10], seed=27)),
    ("relu_exact_halves", "ReLU in the hidden layer, by a table of 12 bits with entries at exact halves", dict(act=["relu", "sigmoid"], lut_bits=12, weight_max=[1, 4], rate=[2, 10], seed=30)),
    ("identity_hidden", "identity in the hidden layer, 12 bits", dict(act=["identity", "sigmoid"], lut_bits=12, weight_max=[1, 4], rate=[2, 10], seed=31)),
    ("table_saturation", "alpha 1/2 and weight_max 8: accumulators leave the table; 7-bit table index", dict(alpha=[0.5, 1], weight_max=[8, 8], lut_bits=7, centre="none", rate=5, seed=20)),
    ("adc6_digital_explicit", "6-bit converters, explicit shift 3, 2-bit slices, row tiles of 32", dict(adc="finite", adc_bits=6, adc_range=3, dac_bits=2, tile_rows=32, subtract="digital", rate=10, seed=21)),
    ("adc6_current_explicit", "the same with current subtraction and 3-bit slices (the last has two bits)", dict(adc="finite", adc_bits=6, adc_range=5, dac_bits=3, tile_rows=32, subtract="current", hidden=[40, 17], rate=[20, 10, 5], seed=22)),
    ("adc8_full", "full range, digital; every tile but the last of a layer is full", dict(adc="finite", adc_bits=8, adc_range="full", dac_bits=2, tile_rows=32, hidden=[40], seed=23)),
    ("adc6_calibrated_digital", "calibrated, digital", dict(adc="finite", adc_bits=6, adc_range="calibrated", dac_bits=2, tile_rows=32, hidden=[40, 17], rate=[20, 10, 5], seed=24)),
    ("adc6_calibrated_current", "calibrated, current, 4-bit drives", dict(adc="finite", adc_bits=6, adc_range="calibrated", dac_bits=2, drive_bits=4, tile_rows=32, subtract="current", hidden=[40, 17], rate=[20, 10, 5], seed=0x0123456789ABCDEF)),
    ("adc5_calibrated_rail", "calibrated, current, 5 bits: here it matters what 'on the rail' means", dict(adc="finite", adc_bits=5, adc_range="calibrated", dac_bits=2, tile_rows=32, subtract="current", hidden=[40, 17], rate=[20, 10, 5], seed=1)),
    ("adc4_tracking_digital", "tracking, digital, accumulate", dict(adc="finite", adc_bits=4, adc_range="tracking", dac_bits=2, tile_rows=32, hidden=[40, 17], rate=[40, 20, 10], epochs=4, seed=30)),
    ("adc6_tracking_current", "tracking, current, online: a look every 64 samples", dict(adc="finite", adc_bits=6, adc_range="tracking", subtract="current", dac_bits=3, tile_rows=32, mode="online", centre="none", rate=[40, 20], epochs=4, seed=31)),
    ("adc5_tracking_replay", "tracking, digital, replay, running centre", dict(adc="finite", adc_bits=5, adc_range="tracking", dac_bits=4, mode="replay", centre="running", hidden=[40], rate=[20, 10], epochs=3, seed=32)),
]


def micro():
    hexes = lambda row: [f"{int(v):08x}" for v in row]
    zero8 = chacha_blocks(0, 0, [0]).astype("<u4").tobytes().hex()
    assert zero8.startswith("3e00ef2f895f40d67f5bb8e81f09a5a12c840ec3ce9a7f3b181be188ef711a1e"), zero8
    assert chacha_blocks(0, 0, [0], rounds=20).astype("<u4").tobytes().hex().startswith("76b8e0ada0f13d90405d6ae55386bd28")
    chacha = []
    for seed, site, layer, path, sub, count, block in [
            (0, 0, 0, 0, 0, 0, 0), (1, 0, 0, 0, 0, 0, 0), (1, 1, 0, 2, 1, 0, 3), (1, 2, 0, 0, 0, 1, 2), (7, 0, 2, 3, 0, 95, 17),
            (0x0123456789ABCDEF, 0, 258, 7, 2, 16, 1), (42, 0, 1, 1, 0xFFFFFFFF, (1 << 36) - 1, (1 << 28) - 1)]:
        w = chacha_blocks(seed, stream_id(site, layer, path, sub), [count << 28 | block])[0]
        chacha.append(dict(seed=str(seed), site=site, layer=layer, pathway=path, sub=sub, count=str(count), block=block,
                           stream=f"{stream_id(site, layer, path, sub):016x}", counter=f"{count << 28 | block:016x}", words=hexes(w)))
    cells = []
    for w, rows, cols, r, c in [(1, 70, 20, 69, 19), (1, 64, 3, 63, 2), (2, 70, 20, 31, 0), (2, 70, 20, 32, 5), (4, 17, 4, 16, 3)]:
        a = draw_cells(5, 0, 1, 2, 0, 9, rows, cols, w)
        n = 64 // w                                     # the page's sentence once more, one cell at a time
        for rr in range(rows):
            for cc in range(cols):
                block = chacha_blocks(5, stream_id(0, 1, 2, 0), [9 << 28 | (cc * -(-rows // n) + rr // n)]).astype("<u4").tobytes()
                assert a[rr, cc] == int.from_bytes(block[rr % n * w:(rr % n + 1) * w], "little")
        cells.append(dict(seed=5, site=0, layer=1, pathway=2, sub=0, count=9, word_bytes=w, rows=rows, columns=cols, row=r, column=c,
                          word=int(a[r, c]), all_row_major_le_sha256=hashlib.sha256(
                              np.ascontiguousarray(a).astype({1: "u1", 2: "<u2", 4: "<u4"}[w]).tobytes()).hexdigest()))
    luts = []
    getcontext().prec = 40
    for act, alpha, wm, lb, db, lut in [("sigmoid", 4, 4, 8, 8, 10), ("sigmoid", 6, 4, 8, 8, 10), ("sigmoid", 4, 2, 8, 8, 10), ("sigmoid", 6, 1, 8, 8, 10),
                                        ("sigmoid", 4, 4, 2, 8, 10), ("sigmoid", 4, 4, 12, 8, 10), ("sigmoid", 4, 4, 8, 4, 10), ("sigmoid", 4, 4, 8, 8, 6),
                                        ("sigmoid", 0.5, 8, 8, 8, 7), ("sigmoid", 1, 8, 8, 8, 7), ("relu", 4, 4, 8, 8, 10), ("identity", 4, 4, 8, 8, 10),
                                        # entries at exact halves, which floating point may put on either side
                                        ("relu", 4, 1, 8, 8, 12), ("identity", 4, 1, 8, 8, 14), ("relu", 4, 1, 8, 2, 6), ("identity", 4, Fr(1, 256), 12, 6, 9),
                                        ("relu", 4, 1, 8, 4, 11), ("relu", 4, 256, 1, 1, 2)]:
        lsh, unit = table_shift(act, alpha, wm, lb, db, lut)
        ta, td = tables(act, alpha, lsh, unit, lut)
        if act == "sigmoid":        # forty digits agree with the double everywhere
            half = 1 << (lut - 1)
            for i in range(-half, half):
                z = 2 * Fr(i) * (1 << lsh) * unit / Fr(alpha)
                y = 1 / (1 + (-(Decimal(z.numerator) / Decimal(z.denominator))).exp())
                assert int(255 * y + Decimal("0.5")) == ta[i + half] and int(255 * 4 * y * (1 - y) + Decimal("0.5")) == td[i + half]
        sha = lambda t: hashlib.sha256(t.astype("u1").tobytes()).hexdigest()
        luts.append(dict(activation=act, alpha=alpha, weight_max_log2=Fr(wm).numerator.bit_length() - Fr(wm).denominator.bit_length(), level_bits=lb, drive_bits=db, lut_bits=lut, lsh=lsh,
                         lut_a_sha256=sha(ta), lut_d_sha256=sha(td), lut_a_sum=int(ta.sum()), lut_d_sum=int(td.sum()),
                         lut_a_middle=ta[len(ta) // 2 - 4:len(ta) // 2 + 4].tolist(), lut_d_middle=td[len(td) // 2 - 4:len(td) // 2 + 4].tolist()))
    inits = []
    for name, _, over in CASES[:3]:
        net = Net(**over)
        for (l, p), lev in net.level.items():
            inits.append(dict(case=name, layer=l, pathway=PATH_NAMES[p], G=net.G[l][PATH_NAMES[p]],
                              column0_rows0to7=lev[:8, 0].tolist(), row0_columns0to7=lev[0, :8].tolist()))
    vals = [-300, -256, -129, -128, -127, -3, -2, -1, 0, 1, 2, 3, 127, 128, 129, 256, 300]
    return {
        "chacha8_zero_key_block0_bytes": zero8, "chacha": chacha, "cell_words": cells,
        "rsh": [[v, s, rsh(v, s)] for v in vals for s in (0, 1, 2, 8)],
        "sat": [[v, n, int(sat(v, n)[0]), sat(v, n)[1]] for v in vals for n in (2, 4, 8)],
        "luts": luts, "initial_levels": inits,
        "tap_words": [dict(ce=ce, taps=t, units=u, words=tap_table(u, ce, t)) for ce, u, ts in
                      ((10, 50, (1, 2, 3, 4)), (3, 50, (1, 2, 3)), (4, 120, (2, 3, 4))) for t in ts],
        "tap_words_sha256_1000_units_ce10": {str(t): hashlib.sha256(np.array(tap_table(1000, 10, t), "u1").tobytes()).hexdigest() for t in (1, 2, 3, 4)},
        "shuffle_48": [dict(seed=seed, epoch=e, order=shuffle_order(seed, e, 48)) for seed in (1, 2) for e in (0, 1)],
        "data_codes_M16": {str(db): data_codes(np.arange(17), 16, db).tolist() for db in (1, 2, 4, 8)},
        "data_codes_M255": {str(db): hashlib.sha256(data_codes(np.arange(256), 255, db).astype("u1").tobytes()).hexdigest() for db in (1, 2, 4, 8)},
        "activity_codes": {str(db): hashlib.sha256(activity_codes(np.arange(256), db).astype("u1").tobytes()).hexdigest() for db in (1, 2, 3, 4, 8)},
        "k_of_the_recipe": rate_shift(20, 32, 1, 8, 8, 8, 4, "sigmoid", 6),
        "data": {str(c): {"pixels_row_major_u8_sha256": hashlib.sha256(dataset(c)[0].astype("u1").tobytes()).hexdigest(),
                          "example_1_first_16": dataset(c)[0][1, :16].tolist()} for c in (3, 10)},
    }


NOTES = {
    "data": DATA_NOTE,
    "digests": "levels: sha256 of rows x columns row-major u16 LE; residuals the same; pruned: one byte 0/1 a cell row-major. "
               "state_level_part: sha256 (not BLAKE3) of u32 LE 1, then for each layer and existing pathway in code order rows, columns (u32 LE), "
               "levels u16 LE, pruned bits LSB first (a pathway ends on a byte), residuals u16 LE: the head of DESIGN section 6.",
    "counts": "cumulative from the first update; saturations_training: forward passes of updates only, evaluation and calibration apart; "
              "error words are booked on the output layer, tap sums on their layer, once for both streams.",
    "other_readings": "state_level_part after the last epoch had the page been read otherwise: alt_residual: the remainder keeps what "
                      "is left of the request when its cell is held at floor or ceiling; alt_tap: stream n sums -S over its taps and rounds, "
                      "instead of negating the rounded sum; alt_rail: calibration counts conversions the clamp changed, not codes that lie on a rail.",
    "batches": "order = shuffle of 0..47 from the identity each epoch; cut in runs of `batch`, the last short; online: one sample a time, k from the configured batch.",
    "tables": "adc ideal: ash null, dac_bits and tile_rows change nothing. ash[layer][stream][slice]: before the first update, and of converters that "
              "track also after each epoch.",
}

if __name__ == "__main__":
    golden = {"notes": NOTES, "micro": micro(), "cases": [run_case(n, note, **over) for n, note, over in CASES]}
    json.dump(golden, sys.stdout, indent=None, separators=(",", ":"))
    print()
