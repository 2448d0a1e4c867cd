"""Own data as other people's programs write them, and what they hold by NumPy's and pandas' own word.

    python3 tests/golden/own_data.py > tests/golden/own_data.json        (NumPy 2, pandas 2 or 3)

Every case is a set of small files, the keys of `[data]` that name them, and what dalean has to read: values and labels of
each part, the full scale, the names of the classes. Nothing here is shared with dalean but the rules of its README: which
examples are cut off as test and validation parts, and that fractions 0 to 1 become floor(x * 255 + 1/2). Values are read
back from the files with numpy.load and pandas.read_csv, not taken from what was written. `tests/it/own_data.rs` replays.
"""

import csv
import gzip
import io
import json
import os
import struct
import tempfile

import numpy as np
import pandas as pd

rng = np.random.default_rng(14)
CASES = []


def codes(values, full_scale):
    """Values of a part as unsigned codes, by the README's rules; parts are (examples, anything)."""
    values = np.asarray(values)
    values = values.reshape(len(values), -1)
    if values.dtype == bool or np.issubdtype(values.dtype, np.integer):
        return values.astype(np.int64)
    if values.max() > 1:
        assert (values == np.floor(values)).all()
        return values.astype(np.int64)
    return np.floor(values.astype(np.float64) * (full_scale or 255) + 0.5).astype(np.int64)


def cut(part, every):
    take = [i for i in range(len(part[0])) if i % every == every - 1]
    keep = [i for i in range(len(part[0])) if i % every != every - 1]
    return tuple(a[keep] for a in part), tuple(a[take] for a in part)


def case(name, files, keys, train, validation=None, test=None, full_scale=None, names=None, said=()):
    """`train` and so on: (values, labels) as read back; labels already as classes or as names of `names`."""
    parts = [train, validation, test]
    floats = not (
        np.asarray(train[0]).dtype == bool or np.issubdtype(np.asarray(train[0]).dtype, np.integer)
    ) and np.asarray(train[0]).max() <= 1
    parts = [None if p is None else (codes(p[0], full_scale), np.asarray(p[1]).reshape(-1)) for p in parts]
    scale = full_scale or (255 if floats else int(max(parts[0][0].max(), 1)))
    if names is not None:
        place = {label: i for i, label in enumerate(names)}
        parts = [None if p is None else (p[0], np.array([place[l] for l in p[1].tolist()])) for p in parts]
    if parts[2] is None:
        parts[0], parts[2] = cut(parts[0], 6)
    if parts[1] is None:
        parts[0], parts[1] = cut(parts[0], 12)
    CASES.append(
        {
            "name": name,
            "files": {k: v.hex() for k, v in files.items()},
            "data": keys,
            "full_scale": scale,
            "names": [] if names is None else [str(n) for n in names],
            "parts": [{"values": p[0].tolist(), "labels": [int(l) for l in p[1]]} for p in parts],
            "said": list(said),
        }
    )


def npz(compressed=False, *args, **arrays):
    out = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(out, *args, **arrays)
    return out.getvalue()


def load(data):
    return np.load(io.BytesIO(data))


def npy(array):
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def text(frame, **how):
    """What pandas writes, as bytes."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "x" + (".gz" if how.get("compression") == "gzip" else ""))
        frame.to_csv(path, **how)
        with open(path, "rb") as file:
            return file.read()


def images(n, shape=(2, 2), top=256):
    return rng.integers(0, top, (n, *shape)).astype(np.uint8)


def labels(n, k=3):
    return (np.arange(n) * 7 % k).astype(np.int64)


# Archives -------------------------------------------------------------------------------------------------------------

keras = npz(True, x_train=images(24), y_train=labels(24).astype(np.uint8), x_test=images(7), y_test=labels(7))
a = load(keras)
kept = dict(train=(a["x_train"], a["y_train"]), test=(a["x_test"], a["y_test"]), full_scale=255)
case("Keras mnist.npz, train alone named", {"mnist.npz": keras}, 'format = "npz"\ntrain = "mnist.npz"\nfull_scale = 255',
     said=["training examples are array `x_train`, their labels `y_train`", "test examples are array `x_test`, their labels `y_test`"], **kept)
case("Keras mnist.npz, named twice", {"mnist.npz": keras},
     'format = "npz"\ntrain = "mnist.npz"\ntest = "mnist.npz"\nfull_scale = 255', said=["test examples are array `x_test`"], **kept)
case("arrays of a part in the training file", {"mnist.npz": keras},
     'format = "npz"\ntrain = "mnist.npz"\ntrain_array = "x_train"\ntrain_labels_array = "y_train"\n'
     'test_array = "x_test"\ntest_labels_array = "y_test"\nfull_scale = 255', **kept)

med = npz(True, train_images=images(12, (2, 3)), train_labels=labels(12).reshape(-1, 1).astype(np.uint8),
          val_images=images(5, (2, 3)), val_labels=labels(5).reshape(-1, 1).astype(np.uint8),
          test_images=images(6, (2, 3)), test_labels=labels(6).reshape(-1, 1).astype(np.uint8))
a = load(med)
case("MedMNIST with a validation part", {"bloodmnist.npz": med}, 'format = "npz"\ntrain = "bloodmnist.npz"\nfull_scale = 255',
     (a["train_images"], a["train_labels"]), (a["val_images"], a["val_labels"]), (a["test_images"], a["test_labels"]), 255,
     said=["validation examples are array `val_images`"])

kmnist = {"kmnist-train-imgs.npz": npz(True, images(24)), "kmnist-train-labels.npz": npz(True, labels(24).astype(np.uint8)),
          "kmnist-test-imgs.npz": npz(True, images(6)), "kmnist-test-labels.npz": npz(True, labels(6).astype(np.uint8))}
a = {k: load(v)["arr_0"] for k, v in kmnist.items()}
case("KMNIST, images and labels in archives of their own, arr_0", kmnist,
     'format = "npz"\ntrain = "kmnist-train-imgs.npz"\ntrain_labels = "kmnist-train-labels.npz"\n'
     'test = "kmnist-test-imgs.npz"\ntest_labels = "kmnist-test-labels.npz"\nfull_scale = 255',
     (a["kmnist-train-imgs.npz"], a["kmnist-train-labels.npz"]), None, (a["kmnist-test-imgs.npz"], a["kmnist-test-labels.npz"]), 255,
     said=["training examples are array `arr_0`"])

one = npz(False, x=rng.random((20, 4)).astype(np.float32), y=labels(20))
a = load(one)
case("x and y, float32 in 0 to 1", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]))
one = npz(False, X=rng.integers(0, 17, (30, 8)).astype(np.float64), y=labels(30, 10))
a = load(one)
case("scikit-learn digits, whole numbers as float64", {"digits.npz": one}, 'format = "npz"\ntrain = "digits.npz"', (a["X"], a["y"]),
     said=["the training values are floats without fractions, read as whole numbers 0 to 16"])
one = npz(False, images(20), labels(20))
a = load(one)
case("numpy.savez by position", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["arr_0"], a["arr_1"]),
     said=["training examples are array `arr_0`, their labels `arr_1`"])
one = npz(False, x=images(20), y=np.where(labels(20, 2) == 0, -1, 1).astype(np.int8))
a = load(one)
case("labels -1 and +1", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]), names=[-1, 1],
     said=["classes 0 to 1 are the labels -1, 1"])
one = npz(False, x=images(104), y=(labels(104, 26) + 1).astype(np.uint8))
a = load(one)
case("EMNIST letters, labels 1 to 26", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]), names=list(range(1, 27)),
     said=["classes 0 to 25 are the labels 1, 2, 3,"])
one = npz(False, x=images(20), y=labels(20).astype(np.float32))
a = load(one)
case("labels as float32", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"].astype(int)))
one = npz(False, x=images(20), y=np.array(["rabbit", "cat", "dögg"])[labels(20)])
a = load(one)
case("labels as unicode strings", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]), names=["cat", "dögg", "rabbit"])
one = npz(False, x=images(20), y=np.array([b"no", b"yes"])[labels(20, 2)])
a = load(one)
case("labels as byte strings", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"].astype(str)), names=["no", "yes"])
one = npz(False, x=np.asfortranarray(images(20)), y=labels(20).astype(">i4"))
a = load(one)
case("Fortran order, big end first", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]))
pair = {"x.npy": npy(images(20)), "y.npy": npy(labels(20))}
a = {k: np.load(io.BytesIO(v)) for k, v in pair.items()}
case("two .npy files", pair, 'format = "npz"\ntrain = "x.npy"\ntrain_labels = "y.npy"', (a["x.npy"], a["y.npy"]))
one = npz(False, x=rng.random((20, 2, 2, 3)), y=labels(20))
a = load(one)
case("colour images, channels last, float64", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"',
     (a["x"].transpose(0, 3, 1, 2), a["y"]))
one = npz(False, x=rng.random((20, 2, 2)) < 0.5, y=labels(20))
a = load(one)
case("boolean images", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]))
one = npz(False, x=images(20).astype(np.int64), y=labels(20).astype(np.uint64))
a = load(one)
case("int64 values, uint64 labels", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"', (a["x"], a["y"]))
two = {"train.npz": npz(False, x=images(24), y=labels(24)), "test.npz": npz(False, x=rng.random((6, 2, 2)), y=labels(6))}
a = {k: load(v) for k, v in two.items()}
case("uint8 in training, float in test, full scale stated", two,
     'format = "npz"\ntrain = "train.npz"\ntest = "test.npz"\nfull_scale = 255',
     (a["train.npz"]["x"], a["train.npz"]["y"]), None, (a["test.npz"]["x"], a["test.npz"]["y"]), 255)
one = npz(False, inputs=images(20), answers=labels(20), more=images(3))
a = load(one)
case("names of one's own, stated", {"own.npz": one},
     'format = "npz"\ntrain = "own.npz"\nexamples_array = "inputs"\nlabels_array = "answers"', (a["inputs"], a["answers"]))
two = {"train.npz": npz(False, x=images(24), y=labels(24)), "test.npz": npz(False, x=images(6), y=labels(6, 2))}
a = {k: load(v) for k, v in two.items()}
case("a test part that misses a class", two, 'format = "npz"\ntrain = "train.npz"\ntest = "test.npz"\nfull_scale = 255',
     (a["train.npz"]["x"], a["train.npz"]["y"]), None, (a["test.npz"]["x"], a["test.npz"]["y"]), 255,
     said=["the test part has no example of class 2"])
one = npz(False, x=images(24), y=labels(24, 2) * 3)
a = load(one)
case("a class without examples, stated", {"own.npz": one}, 'format = "npz"\ntrain = "own.npz"\nclasses = 4', (a["x"], a["y"]),
     said=["the training part has no example of classes 1, 2"])


def idx(array):
    return struct.pack(">BBBB", 0, 0, 8, array.ndim) + struct.pack(f">{array.ndim}I", *array.shape) + array.tobytes()


x, y = images(20), labels(20).astype(np.uint8)
case("IDX, one file packed", {"images-idx3-ubyte.gz": gzip.compress(idx(x)), "labels-idx1-ubyte": idx(y)},
     'format = "idx"\ntrain = "images-idx3-ubyte.gz"\ntrain_labels = "labels-idx1-ubyte"', (x, y))

# Tables ---------------------------------------------------------------------------------------------------------------


def frame(n=24, features=3, k=3, top=256, floats=False):
    values = rng.random((n, features)).round(3) if floats else rng.integers(2, top, (n, features))
    return pd.DataFrame(values, columns=[f"pixel{i}" for i in range(features)]).assign(label=labels(n, k))


def split(table, label="label", drop=()):
    rest = table.drop(columns=[label, *drop])
    return rest.to_numpy(), table[label].to_numpy()


def read(data, **how):
    return pd.read_csv(io.BytesIO(data), **how)


own = 'format = "csv"\ntrain = "own.csv"'

one = text(frame()[["label", "pixel0", "pixel1", "pixel2"]], index=False)
case("Kaggle digit recognizer, label first", {"own.csv": one}, own, split(read(one)), said=["label column `label`, the first of 4 (by its name)"])
one = text(frame(), index=False)
case("label last, by its name", {"own.csv": one}, own, split(read(one)), said=["label column `label`, the last of 4"])
one = text(frame())
case("pandas to_csv with its index", {"own.csv": one}, own, split(read(one, index_col=0)),
     said=["column 0 has no name and numbers the rows: it is left out"])
one = text(frame().sample(frac=1, random_state=1))
case("a shuffled index", {"own.csv": one}, own, split(read(one, index_col=0)), said=["column 0 has no name and numbers the rows"])
one = text(frame().rename(columns={"label": "target"}), index=False)
case("a column called target", {"own.csv": one}, own, split(read(one), "target"), said=["`target`"])
table = frame().rename(columns={f"pixel{i}": i for i in range(3)})
one = text(table[["label", 0, 1, 2]], index=False)
case("a header of numbers beside the label", {"own.csv": one}, own, split(read(one)))
one = text(pd.DataFrame(frame().to_numpy()), index=False)
case("a header made of numbers alone", {"own.csv": one}, own + '\nlabel_column = "last"', split(read(one), "3"),
     said=["the first line (0, 1, 2, 3) is read as names of the columns"])
two = {"train.csv": text(frame(), index=False), "test.csv": text(frame(6)[["pixel2", "label", "pixel0", "pixel1"]], index=False)}
order = ["pixel0", "pixel1", "pixel2", "label"]
case("test columns in another order", two, 'format = "csv"\ntrain = "train.csv"\ntest = "test.csv"\nfull_scale = 255',
     split(read(two["train.csv"])), None, split(read(two["test.csv"])[order]), 255)
two = {"train.csv": text(frame(), index=False), "test.csv": text(frame(6))}
case("an index in the test file alone", two, 'format = "csv"\ntrain = "train.csv"\ntest = "test.csv"\nfull_scale = 255',
     split(read(two["train.csv"])), None, split(read(two["test.csv"], index_col=0)), 255,
     said=["test: column 0 has no name"])
two = {"train.csv": text(frame(), index=False), "test.csv": text(frame(6), index=False, header=False)}
bare = read(two["test.csv"], header=None, names=order)
case("a test file without the header of the training file", two, 'format = "csv"\ntrain = "train.csv"\ntest = "test.csv"\nfull_scale = 255',
     split(read(two["train.csv"])), None, split(bare), 255, said=["test: its columns are told by their places"])
one = text(frame(floats=True), index=False, sep=";", decimal=",")
case("semicolons and decimal commas", {"own.csv": one}, own, split(read(one, sep=";", decimal=",")),
     said=["fields are separated by semicolons", "numbers have decimal commas"])
one = text(frame().assign(label=np.array(["oak", "ash", "beech"])[labels(24)]), index=False, sep="\t")
case("tabs and text labels", {"own.tsv": one}, 'format = "csv"\ntrain = "own.tsv"', split(read(one, sep="\t")), names=["ash", "beech", "oak"],
     said=["fields are separated by tabs"])
one = text(frame().assign(label=np.array(["ähre", "Öl", "é"])[labels(24)]), index=False, encoding="utf-16")
case("UTF-16 with a mark", {"own.csv": one}, own, split(read(one, encoding="utf-16")), names=["Öl", "ähre", "é"])
one = text(frame(), index=False, compression="gzip")
case("gzip", {"own.csv.gz": one}, 'format = "csv"\ntrain = "own.csv.gz"', split(read(one, compression="gzip")))
one = text(frame(), index=False, encoding="utf-8-sig", lineterminator="\r\n")
case("byte order mark and CRLF", {"own.csv": one}, own, split(read(one, encoding="utf-8-sig")))
one = text(frame().assign(label=np.array(['a "quoted"', "b, with comma", "c"])[labels(24)]), index=False, quoting=csv.QUOTE_ALL)
case("quoted fields with commas and quotes", {"own.csv": one}, own, split(read(one)), names=['a "quoted"', "b, with comma", "c"])
digits = frame(24, 4)
digits["pixel3"] = 0
one = text(digits[["label", "pixel0", "pixel1", "pixel2", "pixel3"]], index=False, header=False)
table = read(one, header=None)
case("mnist_train.csv: no header, label first", {"own.csv": one}, own, split(table, 0), said=["label column 0, the first of 5"])
table = frame(24, 4)
table["pixel0"] = 0
one = text(table, index=False, header=False)
case("optdigits: no header, label last", {"own.csv": one}, own, split(read(one, header=None), 4), said=["label column 4, the last of 5"])
one = text(frame().assign(label=frame()["label"].astype(float)), index=False)
table = read(one)
table["label"] = table["label"].astype(int)
case("labels written as 3.0", {"own.csv": one}, own, split(table))
one = text(frame(floats=True), index=False)
case("fractions 0 to 1", {"own.csv": one}, own, split(read(one)))
table = frame(floats=True)
table[["pixel0", "pixel1", "pixel2"]] = (table[["pixel0", "pixel1", "pixel2"]] * 200).round().astype(float)
one = text(table, index=False)
case("whole numbers written as 17.0", {"own.csv": one}, own, split(read(one)), said=["floats without fractions"])
one = text(frame().assign(id=np.arange(24) * 2), index=False)
case("a column left out", {"own.csv": one}, own + '\nignore_columns = ["id"]', split(read(one), drop=["id"]))
one = text(frame(24, 2)[["label", "pixel0", "pixel1"]], index=False, header=False)
case("no header, stated", {"own.csv": one}, own + '\nheader = false\nlabel_column = "first"', split(read(one, header=None), 0))
table = frame().rename(columns={"pixel0": "x", "pixel1": "y", "label": "class"})
one = text(table, index=False)
case("coordinates x and y beside a class", {"own.csv": one}, own, split(read(one), "class"), said=["`class`"])
table = frame().assign(label=np.array(["setosa", "virginica", "versicolor"])[labels(24)]).rename(columns={"label": "kind of iris"})
one = text(table, index=False)
case("the only column of text", {"own.csv": one}, own, split(read(one), "kind of iris"), names=["setosa", "versicolor", "virginica"],
     said=["label column `kind of iris`, the last of 4 (the only one of text)"])

print(json.dumps(CASES, ensure_ascii=False, indent=None, separators=(",", ":")).replace('{"name"', '\n{"name"'))
