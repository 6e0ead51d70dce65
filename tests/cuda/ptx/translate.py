#!/usr/bin/env python3
"""Translates what nvcc makes of kernels (PTX) to C++ that runs on the emulated device.

Usage: translate.py --tables TABLE ... --out FILE.cpp -- sm_80=A.ptx sm_90=A.ptx

Registers become variables, labels targets of goto; memory, barriers and warp functions go to ptx_machine.hpp. A kernel
that is the same for two architectures is written once. At the start of the program they enter the tables of these
names (ptx_machine.hpp). An instruction that is not known ends the translation with its name.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

VALUE = {
    "pred": "bool", "f32": "float", "f64": "double",
    "b8": "std::uint8_t", "b16": "std::uint16_t", "b32": "std::uint32_t", "b64": "std::uint64_t",
    "u8": "std::uint8_t", "u16": "std::uint16_t", "u32": "std::uint32_t", "u64": "std::uint64_t",
    "s8": "std::int8_t", "s16": "std::int16_t", "s32": "std::int32_t", "s64": "std::int64_t",
}  # fmt: skip
WIDER = {"u16": "u32", "s16": "s32", "u32": "u64", "s32": "s64"}
INFIX = {"add": "+", "sub": "-", "and": "&", "or": "|", "xor": "^"}
COMPARE = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
# !(a op b) for operands of which one may be no number.
UNORDERED = {"equ": "!=", "neu": "==", "ltu": ">=", "leu": ">", "gtu": "<=", "geu": "<"}
FUNCTIONS = {"min": "least", "max": "greatest", "sqrt": "std::sqrt", "abs": "std::abs", "fma": "std::fma", "rem": "remainder"}
WHOLE = {"rzi": "std::trunc", "rni": "std::nearbyint", "rmi": "std::floor", "rpi": "std::ceil"}
# What a device does not round to the nearest number, and by how many units in the last place it may be off.
INEXACT = {"div.full.f32": 2, "rcp.approx.f32": 1, "sqrt.approx.f32": 1, "rsqrt.approx.f32": 2, "rsqrt.approx.f64": 1}
BITS = {"brev": "reversed_bits", "clz": "leading_zeros", "popc": "set_bits"}


class Unknown(Exception):
    """An instruction that this file cannot translate."""


class Kernel:
    """One .entry: its C++ text, and what its caller must know."""

    def __init__(self, symbol, parameters, body, first_line, shared):
        self.symbol = symbol
        self.sizes, self.parameter_offset = layout(parameters)
        self.lines = []
        self.local_bytes = 0
        # All shared memory of a kernel is one struct (BRECCIA_SHARED), whose address is 0.
        self.names = {name: "0" for name in shared}
        for number, statement in statements(body, first_line):
            self.lines.extend(self.translated(statement, number))

    def text(self, function):
        local = f"alignas(16) std::byte local[{max(self.local_bytes, 1)}];"
        head = f"void {function}([[maybe_unused]] const std::byte* parameters) {{\n  [[maybe_unused]] {local}\n"
        return head + "".join(f"  {line}\n" for line in self.lines) + "}\n"

    def translated(self, statement, number):
        if statement in "{}":
            return [statement]
        label = re.fullmatch(r"\$?([\w$]+):", statement)
        if label:
            return [f"{label.group(1)}:;"]
        if statement.startswith("."):
            return self.declared(statement)
        guard = re.match(r"@(!?)%(\w+)\s+(.*)", statement, re.S)
        if guard:
            return [f"if ({guard.group(1)}{guard.group(2)}) {{ {self.instruction(guard.group(3), number)} }}"]
        return [self.instruction(statement, number)]

    def declared(self, statement):
        if statement.startswith(".pragma"):
            return []
        local = re.fullmatch(r"\.local \.align \d+ \.b8\s+(\w+)\[(\d+)\]", statement)
        if local:
            self.local_bytes = int(local.group(2))
            self.names[local.group(1)] = "reinterpret_cast<std::uint64_t>(local)"
            return []
        registers = re.fullmatch(r"\.reg \.(\w+)\s+%(\w+)(?:<(\d+)>)?", statement)
        if not registers:
            raise Unknown(statement)
        kind, name, count = registers.groups()
        names = [name] if count is None else [f"{name}{n}" for n in range(int(count))]
        return [f"[[maybe_unused]] {VALUE[kind]} " + ", ".join(f"{n}{{}}" for n in names) + ";"] if names else []

    def instruction(self, text, number):
        opcode, _, rest = text.partition(" ") if " " in text else (text, "", "")
        operands = split_operands(rest)
        base, *mods = opcode.split(".")
        make = getattr(self, f"do_{base}", None)
        try:
            if make is not None:
                return make(mods, operands, number)
            return self.arithmetic(base, mods, operands)
        except (KeyError, IndexError, ValueError) as error:
            raise Unknown(f"{text} ({error!r})") from error

    # Operands.

    def value(self, operand, kind):
        """An operand read as `kind`."""
        operand = operand.strip()
        if re.fullmatch(r"0[fF][0-9a-fA-F]{8}", operand):
            return f"real32(0x{operand[2:]}U)"
        if re.fullmatch(r"0[dD][0-9a-fA-F]{16}", operand):
            return f"real64(0x{operand[2:]}ULL)"
        if re.fullmatch(r"-?\d+", operand):
            return f"static_cast<{VALUE[kind]}>({operand}{'LL' if kind != 'pred' else ''})"
        if re.fullmatch(r"%(n?tid|n?ctaid)\.[xyz]", operand):
            function = {"tid": "thread_index", "ntid": "block_size", "ctaid": "block_index", "nctaid": "grid_size"}
            name, axis = operand[1:].split(".")
            return f"cuda_emulation::{function[name]}().{axis}"
        if operand == "%laneid":
            return "cuda_emulation::lane_of_warp()"
        if operand.startswith("!%"):
            return f"!{operand[2:]}"
        if operand.startswith("%"):
            return f"as<{VALUE[kind]}>({operand[1:]})"
        if operand in self.parameter_offset:
            return f"std::uint64_t{{{self.parameter_offset[operand]}}}"
        if operand in self.names:
            return f"static_cast<{VALUE[kind]}>({self.names[operand]})"
        raise ValueError(f"operand {operand}")

    def address(self, operand, kind="u64"):
        """[register or symbol + offset]."""
        inside = re.fullmatch(r"\[([%\w$]+)(?:\+(-?\d+))?\]", operand)
        return f"{self.value(inside.group(1), kind)} + static_cast<{VALUE[kind]}>({inside.group(2) or 0}LL)"

    @staticmethod
    def assign(destination, value):
        return f"put({destination.strip()[1:]}, {value});"

    # Instructions, by the part of their name before the first dot.

    def arithmetic(self, base, mods, operands):
        kind = mods[-1]
        flushed = "ftz" in mods and kind == "f32"
        read = (lambda o: f"flushed({self.value(o, kind)})") if flushed else (lambda o: self.value(o, kind))
        values = [read(o) for o in operands[1:]]
        units = INEXACT.get(f"{base}.{mods[0]}.{kind}")
        allowed = {"rn", "ftz", "lo", kind}
        if not set(mods if units is None else mods[1:]) <= allowed:
            raise KeyError(".".join(mods))
        if base in INFIX:
            result = f"wrapping<{VALUE[kind]}>([](auto a, auto b) {{ return a {INFIX[base]} b; }}, {values[0]}, {values[1]})"
        elif base in FUNCTIONS:
            result = f"{FUNCTIONS[base]}({', '.join(values)})"
        elif base in BITS:
            result = f"{BITS[base]}({values[0]})"
        elif base == "mul":
            result = f"wrapping<{VALUE[kind]}>([](auto a, auto b) {{ return a * b; }}, {values[0]}, {values[1]})"
        elif base == "mad":
            result = f"wrapping<{VALUE[kind]}>([](auto a, auto b, auto c) {{ return a * b + c; }}, {', '.join(values)})"
        elif base == "div":
            result = f"quotient({values[0]}, {values[1]})"
        elif base == "rcp":
            result = f"{VALUE[kind]}(1) / {values[0]}"
        elif base == "rsqrt":
            result = f"{VALUE[kind]}(1) / std::sqrt({values[0]})"
        elif base == "neg":
            result = f"negative({values[0]})"
        elif base == "not":
            result = f"!{values[0]}" if kind == "pred" else f"static_cast<{VALUE[kind]}>(~{values[0]})"
        elif base in ("shl", "shr"):
            result = f"shifted_{'left' if base == 'shl' else 'right'}({values[0]}, {self.value(operands[2], 'u32')})"
        elif base == "bfi":
            values = [self.value(o, kind) for o in operands[1:3]] + [self.value(o, "u32") for o in operands[3:]]
            result = f"inserted({', '.join(values)})"
        else:
            raise KeyError(base)
        if units is not None:
            result = f"inexact({result}, {units})"
        return self.assign(operands[0], f"flushed({result})" if flushed else result)

    def do_mul(self, mods, operands, _):
        if mods[0] not in ("wide", "hi"):
            return self.arithmetic("mul", mods, operands)
        kind = mods[1]
        a, b = (self.value(o, kind) for o in operands[1:])
        if mods[0] == "wide":
            return self.assign(operands[0], f"product<{VALUE[WIDER[kind]]}>({a}, {b})")
        return self.assign(operands[0], f"high_half({a}, {b})")

    def do_mad(self, mods, operands, _):
        if mods[0] != "wide":
            return self.arithmetic("mad", mods, operands)
        kind, wide = mods[1], VALUE[WIDER[mods[1]]]
        a, b, c = self.value(operands[1], kind), self.value(operands[2], kind), self.value(operands[3], WIDER[kind])
        return self.assign(operands[0], f"wrapping<{wide}>([](auto x, auto y) {{ return x + y; }}, product<{wide}>({a}, {b}), {c})")

    def do_bfind(self, mods, operands, _):
        if mods != ["shiftamt", "u32"]:
            raise KeyError(".".join(mods))
        return self.assign(operands[0], f"shift_to_top({self.value(operands[1], 'u32')})")

    def do_setp(self, mods, operands, _):
        how, kind = mods[0], mods[-1]
        a, b = (self.value(o, kind) for o in operands[1:])
        if mods[1:-1] == ["ftz"]:
            a, b = f"flushed({a})", f"flushed({b})"
        elif mods[1:-1]:
            raise KeyError(".".join(mods))
        if how in UNORDERED:
            return self.assign(operands[0], f"!({a} {UNORDERED[how]} {b})")
        if kind.startswith("f") and how == "ne":
            return self.assign(operands[0], f"({a} < {b} || {a} > {b})")
        return self.assign(operands[0], f"{a} {COMPARE[how]} {b}")

    def do_selp(self, mods, operands, _):
        a, b = (self.value(o, mods[-1]) for o in operands[1:3])
        return self.assign(operands[0], f"{self.value(operands[3], 'pred')} ? {a} : {b}")

    def do_mov(self, mods, operands, _):
        kind = mods[0]
        if operands[0].startswith("{"):
            low, high = braced(operands[0])
            half = VALUE["b" + str(int(kind[1:]) // 2)]
            source = f"as<{VALUE[kind]}>({operands[1][1:]})"
            shift = int(kind[1:]) // 2
            return f"put({low[1:]}, static_cast<{half}>({source})); put({high[1:]}, static_cast<{half}>({source} >> {shift}));"
        if operands[1].startswith("{"):
            half = "b" + str(int(kind[1:]) // 2)
            low, high = (f"static_cast<{VALUE[kind]}>({self.value(o, half)})" for o in braced(operands[1]))
            return self.assign(operands[0], f"static_cast<{VALUE[kind]}>({low} | {high} << {int(kind[1:]) // 2})")
        return self.assign(operands[0], self.value(operands[1], kind))

    def do_cvta(self, mods, operands, _):
        return self.assign(operands[0], self.value(operands[1], mods[-1]))  # addresses keep to their space

    def do_cvt(self, mods, operands, _):
        to, source = mods[-2], mods[-1]
        value = self.value(operands[1], source)
        flush = "ftz" in mods
        rounding = [m for m in mods[:-2] if m != "ftz"]
        if flush and source == "f32":
            value = f"flushed({value})"
        if source.startswith("f") and not to.startswith("f"):
            return self.assign(operands[0], f"saturated<{VALUE[to]}>({WHOLE[rounding[0]]}({value}))")
        if to == source and rounding and rounding[0] in WHOLE:
            return self.assign(operands[0], f"{WHOLE[rounding[0]]}({value})")
        if rounding not in ([], ["rn"]):
            raise KeyError(".".join(mods))
        result = f"static_cast<{VALUE[to]}>({value})"
        return self.assign(operands[0], f"flushed({result})" if flush and to == "f32" else result)

    # Memory.

    def place(self, space, kind, count, operand, number):
        element = VALUE[kind]
        if space == "param":
            return f"in_parameters<{element}>(parameters, {self.address(operand)})"
        if space == "shared":
            return f"in_shared<{element}, {count}>({self.address(operand, 'u32')}, {number})"
        if space == "local":
            return f"in_local<{element}, {count}>(local, sizeof local, {self.address(operand)}, {number})"
        if space == "global":
            return f"in_global<{element}, {count}>({self.address(operand)}, {number})"
        raise KeyError(f"space {space}")

    def do_ld(self, mods, operands, number):
        space, kind, count = self.access(mods)
        place = self.place(space, kind, count, operands[1], number)
        targets = braced(operands[0]) if count > 1 else [operands[0]]
        puts = " ".join(self.assign(t, f"from[{n}]") for n, t in enumerate(targets) if t != "_")
        return f"{{ const auto* from = {place}; {puts} }}"

    def do_st(self, mods, operands, number):
        space, kind, count = self.access(mods)
        place = self.place(space, kind, count, operands[0], number)
        sources = braced(operands[1]) if count > 1 else [operands[1]]
        puts = " ".join(f"to[{n}] = {self.value(s, kind)};" for n, s in enumerate(sources))
        return f"{{ auto* to = {place}; {puts} }}"

    @staticmethod
    def access(mods):
        mods = [m for m in mods if m not in ("nc", "volatile", "relaxed")]
        count = int(mods[1][1:]) if re.fullmatch(r"v[248]", mods[1]) else 1
        return mods[0], mods[-1], count

    def do_atom(self, mods, operands, number):
        mods = [m for m in mods if m not in ("relaxed", "gpu")]
        space, operation, kind = mods
        place = self.place(space, kind, 1, operands[1], number)
        function = {"add": "atomicAdd", "max": "atomicMax", "or": "atomicOr", "cas": "atomicCAS"}[operation]
        values = ", ".join(self.value(o, kind) for o in operands[2:])
        return self.assign(operands[0], f"{function}({place}, {values})")

    # Control, and what threads do together.

    @staticmethod
    def do_bra(_, operands, __):
        return f"goto {operands[0].lstrip('$')};"

    @staticmethod
    def do_ret(*_):
        return "return;"

    def do_bar(self, mods, operands, number):
        if mods == ["sync"] and operands == ["0"]:
            return f"cuda_emulation::synchronise_block({number});"
        if mods == ["warp", "sync"]:
            return f"__syncwarp({self.value(operands[0], 'u32')}, {number});"
        if mods == ["red", "popc", "u32"] and operands[1] == "0":
            count = f"cuda_emulation::reduce_block({self.value(operands[2], 'pred')} ? 1U : 0U, {number})"
            return self.assign(operands[0], count)
        raise KeyError(".".join(mods))

    def do_vote(self, mods, operands, number):
        if mods != ["sync", "ballot", "b32"]:
            raise KeyError(".".join(mods))
        mask, predicate = self.value(operands[2], "u32"), self.value(operands[1], "pred")
        return self.assign(operands[0], f"__ballot_sync({mask}, {predicate} ? 1 : 0, {number})")

    def do_redux(self, mods, operands, number):
        if mods != ["sync", "or", "b32"]:
            raise KeyError(".".join(mods))
        mask, value = self.value(operands[2], "u32"), self.value(operands[1], "u32")
        return self.assign(operands[0], f"__reduce_or_sync({mask}, {value}, {number})")

    def do_shfl(self, mods, operands, number):
        if mods[0] != "sync" or mods[2] != "b32":
            raise KeyError(".".join(mods))
        destination, _, predicate = operands[0].partition("|")
        value, by, clamp, mask = (self.value(o, "u32") for o in operands[1:])
        predicate = predicate[1:] if predicate else "nobody"
        source = f"const unsigned source = shuffle_source(Shuffle::{mods[1]}, {by}, {clamp}, inside);"
        shuffled = f"cuda_emulation::shuffle({mask}, {value}, source, {number})"
        keep = f" {predicate} = inside;" if predicate != "nobody" else ""
        return f"{{ bool inside = true; {source} {self.assign(destination, shuffled)}{keep} }}"


def layout(parameters):
    """Sizes of the parameters, and where each lies when all are laid out as in a struct."""
    sizes, offsets, at = [], {}, 0
    for align, kind, name, count in re.findall(r"\.param (?:\.align (\d+) )?\.(\w+) (\w+)(?:\[(\d+)\])?", parameters):
        size = int(count) if count else int(kind[1:]) // 8
        align = int(align) if align else size
        at = -(-at // align) * align
        sizes.append(size)
        offsets[name] = at
        at += size
    return sizes, offsets


def braced(operand):
    return [part.strip() for part in operand.strip("{} ").split(",")]


def split_operands(text):
    """Commas inside braces do not separate."""
    return [part.strip() for part in re.findall(r"(?:\{[^}]*\}|[^,{}])+", text.strip()) if part.strip()]


def statements(body, first_line):
    """(line, text) of each statement or label."""
    waiting, begun = "", 0
    for number, line in enumerate(body.split("\n"), first_line):
        line = re.sub(r"//.*", "", line).strip()
        for part in re.findall(r"\$?[\w$]+:(?!:)|[^;]*;|[^;]+$", line):
            part = part.strip()
            if not waiting:
                begun = number
                while scope := re.match(r"[{}]\s*(?![%\d])", part):
                    yield number, part[0]
                    part = part[scope.end() :]
                if not part:
                    continue
            if re.fullmatch(r"\$?[\w$]+:", part) and not waiting:
                yield number, part
                continue
            waiting = f"{waiting} {part}".strip()
            if waiting.endswith(";"):
                yield begun, re.sub(r"\s+", " ", waiting[:-1]).strip()
                waiting = ""


def kernels_of(path):
    text = Path(path).read_text(encoding="utf-8")
    shared = re.findall(r"\.extern \.shared \.align \d+ \.b8 (\w+)\[\];", text)
    for entry in re.finditer(r"\.entry (\w+)\((.*?)\)\s*((?:\.\w+[^\n{]*\n)*)\{\n(.*?)\n\}", text, re.S):
        first_line = text.count("\n", 0, entry.start(4)) + 1
        yield Kernel(entry.group(1), entry.group(2), entry.group(4), first_line, shared)


def readable(symbols):
    """Names as the emulation makes them of kernels: tile_pass<float>."""
    output = subprocess.run(["c++filt", *symbols], capture_output=True, text=True, check=True).stdout
    return [bare(name) for name in output.splitlines()]


def bare(name):
    name = re.sub(r"\(anonymous namespace\)", "", name)
    depth, start = 0, 0
    for place, c in enumerate(name):
        depth += {"<": 1, ">": -1}.get(c, 0)
        if depth == 0 and c in " :":
            start = place + 1
        if depth == 0 and c == "(":
            return name[start:place]
    return name[start:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tables", nargs="+", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("inputs", nargs="+", metavar="ARCH=FILE")
    options = parser.parse_args()
    functions, rows = {}, []
    for argument in options.inputs:
        arch, _, path = argument.partition("=")
        try:
            kernels = list(kernels_of(path))
        except Unknown as unknown:
            sys.exit(f"{path}: cannot translate: {unknown}")
        for kernel, name in zip(kernels, readable([k.symbol for k in kernels])):
            body = (name, tuple(kernel.lines), tuple(kernel.sizes))
            function, _ = functions.setdefault(body, (f"kernel_{len(functions)}", kernel))
            sizes = ", ".join(map(str, kernel.sizes))
            rows += [f'    {{"{table}", "{arch}", "{name}", {{{{{sizes}}}, &{function}}}}},' for table in options.tables]
    text = ['#include "tests/cuda/ptx/ptx_machine.hpp"\n', "namespace breccia::cuda_ptx {", "namespace {\n"]
    text += [kernel.text(function) for function, kernel in functions.values()]
    text += ["const Enter enter{", *rows, "};\n", "}  // namespace", "}  // namespace breccia::cuda_ptx"]
    Path(options.out).write_text("\n".join(text) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
