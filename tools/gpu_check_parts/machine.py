"""What tools/gpu-check runs on: the device, the machine, and a build for both."""

import ctypes
import os
import re
import subprocess
from typing import NamedTuple

from .programs import ROOT, Unfinished

TARGETS = ["breccia", "breccia_bench", "breccia_cuda", "test_cuda_device"]
# Features of a processor (/proc/cpuinfo) by the instruction sets that the kernels of the host can be built for, best first.
V3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
INSTRUCTION_SETS = {
    "x86-64-v4": V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    "x86-64-v3": V3,
    "x86-64-v2": set(),
}


class NoDevice(Exception):
    pass


class Device(NamedTuple):
    name: str
    arch: int  # 90 for sm_90; 0: emulated
    count: int


def first_device():
    try:
        driver = ctypes.CDLL("libcuda.so.1")
    except OSError as error:
        raise NoDevice(f"there is no CUDA device here ({error}): nothing has been checked") from error
    count, major, minor, name = ctypes.c_int(), ctypes.c_int(), ctypes.c_int(), ctypes.create_string_buffer(256)
    status = driver.cuInit(0) or driver.cuDeviceGetCount(ctypes.byref(count))
    if status != 0 or count.value == 0:
        raise NoDevice(f"there is no CUDA device here (the driver says {status}): nothing has been checked")
    compute_major, compute_minor = 75, 76  # CUdevice_attribute
    driver.cuDeviceGetName(name, 256, 0)
    driver.cuDeviceGetAttribute(ctypes.byref(major), compute_major, 0)
    driver.cuDeviceGetAttribute(ctypes.byref(minor), compute_minor, 0)
    return Device(name.value.decode(), 10 * major.value + minor.value, count.value)


def best_instruction_set(cpuinfo):
    flags = set((found(r"^flags\s*:(.*)", cpuinfo) or "").split())
    return next(name for name, needed in INSTRUCTION_SETS.items() if needed <= flags)


def build(programs, device):
    """For this device and this processor alone: minutes matter, and the host is to be at its best."""
    folder = ROOT / "build/gpu-check"
    with open("/proc/cpuinfo", encoding="utf-8") as cpuinfo:
        isa = best_instruction_set(cpuinfo.read())
    for command in (
        ["cmake", "--preset", "cuda", "-B", str(folder), f"-DCMAKE_CUDA_ARCHITECTURES={device.arch}-real",
         f"-DBRECCIA_ISAS={isa}"],
        ["cmake", "--build", str(folder), "--parallel", str(os.cpu_count()), "--target", *TARGETS],
    ):  # fmt: skip
        ended = programs.run(command)
        if ended.failure:
            raise Unfinished(f"the build: {' '.join(command[:2])} {ended.failure}:\n{ended.out[-4000:]}{ended.errors[-4000:]}")
    return folder


def said(*command):
    """What a tool of the machine prints; nothing where it is not here or fails."""
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=20).stdout
    except (OSError, subprocess.SubprocessError):
        return ""


def found(pattern, text):
    match = re.search(pattern, text, re.M)
    return match[1] if match else None


def facts(programs, folder, commit):
    """What was checked, and where: figures without it cannot be compared. `breccia info` says what the host uses."""
    info = programs.run([folder / "breccia", "info"], 30).out
    return {
        "commit": commit or found(r"^(\S+)", said("git", "describe", "--always", "--dirty", "--abbrev=12")),
        "driver": found(r"^(\S+)", said("nvidia-smi", "--query-gpu=driver_version", "--format=csv,noheader")),
        "toolkit": found(r"release (.*)", said("nvcc", "--version")),
        "host": found(r"^devices +host: (.*)", info),
        "instruction_set": found(r"^simd +(.*)", info),
    }
