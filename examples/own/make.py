"""Makes the files of this folder: 240 pictures of 4 x 4, each with a bright beam at the left, in the middle or at the right.

    python3 examples/own/make.py          (NumPy)
"""

import csv
import pathlib
import struct

import numpy as np

here = pathlib.Path(__file__).parent
rng = np.random.default_rng(7)
names = ["left", "middle", "right"]

kind = rng.integers(0, 3, 240)
images = rng.integers(0, 120, (240, 4, 4))
for image, which in zip(images, kind):
    image[:, which : which + 2] = rng.integers(90, 256, (4, 2))
images = images.astype(np.uint8)

with open(here / "beams.csv", "w", newline="") as file:
    table = csv.writer(file)
    table.writerow(["beam", *(f"pixel{i}" for i in range(16))])
    table.writerows([names[k], *row] for k, row in zip(kind, images.reshape(240, 16).tolist()))

np.savez_compressed(
    here / "beams.npz",
    x_train=images[:200], y_train=kind[:200], x_test=images[200:], y_test=kind[200:],
)


def idx(array):
    head = struct.pack(">BBBB", 0, 0, 8, array.ndim) + struct.pack(f">{array.ndim}I", *array.shape)
    return head + array.astype(np.uint8).tobytes()


(here / "beams-images-idx3-ubyte").write_bytes(idx(images))
(here / "beams-labels-idx1-ubyte").write_bytes(idx(kind))
