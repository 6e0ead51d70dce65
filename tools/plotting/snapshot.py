"""Snapshots as numpy arrays."""

import json
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np


@dataclass
class Snapshot:
    """Positions (N,3) [m], the bodies' numbers (N), and what the header says."""

    path: str
    position: np.ndarray
    body: np.ndarray
    time: float
    cell: float
    scene_name: str
    body_names: list

    def values(self, name):
        """A scalar field (N) and its unit; vectors give their length. KeyError names the fields there are."""
        with h5py.File(self.path) as file:
            group = file["PartType0"]
            if name not in group:
                raise KeyError(f"{self.path}: no field {name}; there are {', '.join(sorted(group))}")
            data = group[name][...]
            unit = _text(group[name].attrs.get("Units", ""))
        if data.ndim == 2:
            data = np.linalg.norm(data, axis=1)
        return data.astype(float), unit


def _text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def _body_names(scene):
    """From the scene's keys as the snapshot has them: {"body[0].name": "target", ...}."""
    try:
        keys = json.loads(scene)
    except json.JSONDecodeError:
        return []
    names = []
    while f"body[{len(names)}].name" in keys:
        names.append(keys[f"body[{len(names)}].name"])
    return names


def read(path):
    """Reads a snapshot or any file with /PartType0/Coordinates. OSError, KeyError, ValueError say what is wrong."""
    if not Path(path).is_file():
        raise OSError(f"{path}: no such file")
    with h5py.File(path) as file:
        if "PartType0/Coordinates" not in file:
            raise KeyError(f"{path}: no dataset /PartType0/Coordinates")
        position = file["PartType0/Coordinates"][...].astype(float)
        if len(position) < 2:
            raise ValueError(f"{path}: too few particles to draw")
        bodies = file.get("PartType0/BodyIDs")
        body = bodies[...] if bodies is not None else np.zeros(len(position), dtype=int)
        header = file["Header"].attrs if "Header" in file else {}
        scene = file["Parameters/Scene"][()].decode() if "Parameters/Scene" in file else ""
        return Snapshot(
            path=str(path),
            position=position,
            body=body.astype(int),
            time=float(header.get("Time", 0.0)),
            cell=float(header.get("CellSize", 0.0)),
            scene_name=_text(header.get("SceneName", "")),
            body_names=_body_names(scene),
        )
