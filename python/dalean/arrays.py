"""Tensors in files: safetensors, which checkpoints are."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from .errors import CheckpointError

_KINDS = {
    "BOOL": np.bool_,
    "U8": np.uint8,
    "I8": np.int8,
    "U16": np.uint16,
    "I16": np.int16,
    "U32": np.uint32,
    "I32": np.int32,
    "U64": np.uint64,
    "I64": np.int64,
    "F16": np.float16,
    "BF16": np.uint16,  # the upper half of a float32
    "F32": np.float32,
    "F64": np.float64,
}


def read_safetensors(source: str | os.PathLike | bytes) -> dict[str, np.ndarray]:
    """Arrays by name, of a file or of its bytes; they are copies.

    :raises dalean.CheckpointError: when it is not such a file.
    """
    name = "the bytes" if isinstance(source, bytes) else str(source)
    try:
        content = source if isinstance(source, bytes) else Path(source).read_bytes()
        size = int.from_bytes(content[:8], "little")
        if size > len(content) - 8:
            raise ValueError("its head is longer than the file")
        head = json.loads(content[8 : 8 + size])
        arrays = {}
        for tensor, about in head.items():
            if tensor == "__metadata__":
                continue
            first, last = about["data_offsets"]
            kind, shape = np.dtype(_KINDS[about["dtype"]]), tuple(about["shape"])
            if not 0 <= first <= last <= len(content) - 8 - size:
                raise ValueError(f"tensor {tensor} lies outside the file")
            numbers = np.frombuffer(content, kind, offset=8 + size + first, count=(last - first) // kind.itemsize)
            if about["dtype"] == "BF16":
                numbers = (numbers.astype(np.uint32) << 16).view(np.float32)
            arrays[tensor] = numbers.reshape(shape).copy()
        return arrays
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        found, allowed = f"cannot be read as safetensors: {error}", "name a checkpoint"
        raise CheckpointError(f"{name} {found}; {allowed}", name, found, allowed) from error
