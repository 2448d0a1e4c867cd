"""Makes the files of this folder: 240 pictures of 4 x 4, each a bright row, column or diagonal in noise.

    python3 examples/own/make.py          (NumPy)
"""

import csv
import pathlib
import struct

import numpy as np

here = pathlib.Path(__file__).parent
rng = np.random.default_rng(7)
names = ["column", "diagonal", "row"]

kind = rng.integers(0, 3, 240)
images = rng.integers(0, 90, (240, 4, 4))
for image, which in zip(images, kind):
    at = rng.integers(0, 4)
    bright = rng.integers(150, 256, 4)
    if names[which] == "row":
        image[at, :] = bright
    elif names[which] == "column":
        image[:, at] = bright
    else:
        image[range(4), [(i + at) % 4 for i in range(4)]] = bright
images = images.astype(np.uint8)

with open(here / "lines.csv", "w", newline="") as file:
    table = csv.writer(file)
    table.writerow(["shape", *(f"pixel{i}" for i in range(16))])
    table.writerows([names[k], *row] for k, row in zip(kind, images.reshape(240, 16).tolist()))

np.savez_compressed(
    here / "lines.npz",
    x_train=images[:200], y_train=kind[:200], x_test=images[200:], y_test=kind[200:],
)


def idx(array):
    head = struct.pack(">BBBB", 0, 0, 8, array.ndim) + struct.pack(f">{array.ndim}I", *array.shape)
    return head + array.astype(np.uint8).tobytes()


(here / "lines-images-idx3-ubyte").write_bytes(idx(images))
(here / "lines-labels-idx1-ubyte").write_bytes(idx(kind))
