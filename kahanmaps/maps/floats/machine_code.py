"""Straight-line steps as machine code: LLVM compiles them, through llvmlite, which comes with numba (the extra `fast`).

The code of a step (straight_line.py) is written down as LLVM's intermediate language for vectors of orbits, with a loop
over the steps around it, and compiled in a fraction of a second. (Numba would take 10 to 20 seconds for the same loop,
most of them in its own analysis of Python code, and would have to keep the machine code on disk.) The loop takes a
vector of orbits, or a single one, through all the steps in registers. After each step it looks once at whether the fast
step was right in all orbits of the vector; if not, those concerned take the careful step instead, and what they met is
noted. Without fast-math flags nothing is contracted or reordered: numbers are those of numpy.

Machine code is called through ctypes, which releases the interpreter lock: threads can work on ranges of orbits.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]

from kahanmaps.maps.floats.steps import OVERFLOW, SINGULAR, FloatStep, Lanes, Table
from kahanmaps.maps.floats.straight_line import Code, Value

_FORMS = {
    **{name: f"f{name} {{v}} {{0}}, {{1}}" for name in ("add", "sub", "mul", "div")},
    **{name: f"fcmp {word} {{v}} {{0}}, {{1}}" for name, word in {"gt": "ogt", "le": "ole", "eq": "oeq"}.items()},
    **{name: f"{name} {{m}} {{0}}, {{1}}" for name in ("and", "or")},
    "neg": "fneg {v} {0}",
    "abs": "call {v} @llvm.fabs.{s}({v} {0})",
    "not": "xor {m} {0}, {true}",
    "select": "select {m} {0}, {v} {1}, {v} {2}",
}
_NEVER = 1 << 62


class MachineCode:
    """A step as machine code for vectors of `width` orbits, which takes ranges of orbits through steps."""

    def __init__(self, step: FloatStep, width: int) -> None:
        self._engine, self._call = _compiled(_text(step, width))

    def advance(self, lanes: Lanes, low: int, high: int, first: int, steps: int, tables: Sequence[Table]) -> None:
        """Take the orbits low, ..., high - 1 `steps` steps from the index `first`; there are at most two tables."""
        records: list[Any] = []
        for every, states in tables:
            records += [states.ctypes.data, every, every - first % every]
        records += [None, _NEVER, _NEVER] * (2 - len(tables))
        arrays = (array.ctypes.data for array in lanes)
        self._call(*arrays, lanes.z.shape[1], low, high, first, steps, *records)


@lru_cache(maxsize=32)
def _compiled(text: str) -> tuple[Any, Any]:
    """The engine that holds the machine code of a module, and its function `advance`."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    machine = llvm.Target.from_default_triple().create_target_machine(llvm.get_host_cpu_name(), features, opt=2)
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    module.verify()
    engine = llvm.create_mcjit_compiler(module, machine)  # to which the machine belongs from now on
    engine.finalize_object()
    kinds = [ctypes.c_void_p] * 5 + [ctypes.c_int64] * 5 + [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64] * 2
    return engine, ctypes.CFUNCTYPE(None, *kinds)(engine.get_function_address("advance"))


def _text(step: FloatStep, width: int) -> str:
    """The module in LLVM's language.

    The function advance(z, status, failed_at, near, near_at, n, low, high, first, steps, table, every, until, ...) has
    two loops, over vectors of orbits and over steps. Orbits of a vector beyond the last one count as ended.
    """
    if step.fast_code is None:
        raise ValueError("a step that is not written out has no machine code")
    rows, v, m, w = range(step.rows), f"<{width} x double>", f"<{width} x i1>", f"<{width} x i64>"
    s = f"v{width}f64"

    def splat(kind: str, value: Any) -> str:
        return "<" + ", ".join([f"{kind} {value}"] * width) + ">"

    def number(x: Any) -> str:
        if isinstance(x, bool):
            return splat("i1", int(x))
        return splat("double", f"0x{struct.unpack('<Q', struct.pack('<d', float(x)))[0]:016X}")

    def load(name: str, kind: str, element: str, place: str, other: str) -> list[str]:
        of = f"v{width}{'f64' if element == 'double' else 'i64'}"
        return [
            f"%{name}.p = getelementptr {element}, ptr {place}",
            f"%{name} = call {kind} @llvm.masked.load.{of}.p0(ptr %{name}.p, i32 8, {m} %there, {kind} {other})",
        ]

    def store(name: str, kind: str, element: str, place: str, value: str, mask: str) -> list[str]:
        of = f"v{width}{'f64' if element == 'double' else 'i64'}"
        return [
            f"%{name}.p = getelementptr {element}, ptr {place}",
            f"call void @llvm.masked.store.{of}.p0({kind} {value}, ptr %{name}.p, i32 8, {m} {mask})",
        ]

    def body(code: Code, prefix: str) -> tuple[list[str], list[str]]:
        """The operations, and the names of the outputs."""

        def name(x: Any) -> str:
            if not isinstance(x, Value):
                return number(x)
            return f"%x{x.number}" if x.number < code.inputs else f"%{prefix}{x.number}"

        lines = []
        for k, (operation, operands) in enumerate(code.operations, code.inputs):
            x = [name(operand) for operand in operands]
            if operation in ("max", "min"):
                lines.append(f"%{prefix}{k}.c = fcmp {'ogt' if operation == 'max' else 'olt'} {v} {x[0]}, {x[1]}")
                x, operation = [f"%{prefix}{k}.c", *x], "select"
            lines.append(f"%{prefix}{k} = {_FORMS[operation].format(*x, v=v, m=m, s=s, true=splat('i1', 1))}")
        return lines, [name(x) for x in code.outputs]

    fast, (*image, good) = body(step.fast_code, "f")
    careful, (*again, near, singular, overflow) = body(step.careful_code, "c")
    arrays = ("status", "failed", "near", "nearat")
    parameters = ["ptr %z", *(f"ptr %{name}.a" for name in arrays)]
    parameters += [f"i64 %{name}" for name in ("n", "low", "high", "first", "steps")]
    parameters += [
        f"{kind} %{name}{t}" for t in (0, 1) for kind, name in (("ptr", "table"), ("i64", "every"), ("i64", "until"))
    ]
    lines = [
        f"declare {v} @llvm.fabs.{s}({v})",
        f"declare i1 @llvm.vector.reduce.and.v{width}i1({m})",
        *(f"declare {k} @llvm.masked.load.{t}.p0(ptr, i32, {m}, {k})" for k, t in ((v, s), (w, f"v{width}i64"))),
        *(f"declare void @llvm.masked.store.{t}.p0({k}, ptr, i32, {m})" for k, t in ((v, s), (w, f"v{width}i64"))),
        f"define void @advance({', '.join(parameters)}) {{",
        "entry: br label %vector",
        "vector:",
        "%at = phi i64 [%low, %entry], [%at.next, %finish]",
        f"%at.one = insertelement {w} poison, i64 %at, i32 0",
        f"%at.all = shufflevector {w} %at.one, {w} poison, <{width} x i32> zeroinitializer",
        f"%lane = add {w} %at.all, <{', '.join(f'i64 {k}' for k in range(width))}>",
        f"%high.one = insertelement {w} poison, i64 %high, i32 0",
        f"%high.all = shufflevector {w} %high.one, {w} poison, <{width} x i32> zeroinitializer",
        f"%there = icmp slt {w} %lane, %high.all",
        *load("status", w, "i64", "%status.a, i64 %at", splat("i64", 1)),
        f"%dead.start = icmp ne {w} %status, zeroinitializer",
    ]
    for i in rows:
        lines += [f"%z{i}.r = mul i64 %n, {i}", f"%z{i}.o = add i64 %z{i}.r, %at"]
        lines += load(f"z{i}", v, "double", f"%z, i64 %z{i}.o", "zeroinitializer")
    lines += ["br label %loop", "loop:"]
    lines += [f"%x{i} = phi {v} [%z{i}, %vector], [%y{i}, %next]" for i in rows]
    lines += [
        f"%dead = phi {m} [%dead.start, %vector], [%dead.after, %next]",
        "%index = phi i64 [%first, %vector], [%index.next, %next]",
        "%left = phi i64 [%steps, %vector], [%left.next, %next]",
    ]
    for t in (0, 1):
        lines.append(f"%wait{t} = phi i64 [%until{t}, %vector], [%wait{t}.next, %next]")
        lines.append(f"%place{t} = phi i64 [%at, %vector], [%place{t}.next, %next]")
    lines += [
        *fast,
        f"%fine = or {m} {good}, %dead",
        f"%all = call i1 @llvm.vector.reduce.and.v{width}i1({m} %fine)",
        "br i1 %all, label %stepped, label %careful, !prof !0",
        "careful:",
        *careful,
        f"%asked = xor {m} %fine, {splat('i1', 1)}",
        f"%zero = and {m} %asked, {singular}",
        f"%over = and {m} %asked, {overflow}",
        f"%ended = or {m} %zero, %over",
        f"%close = and {m} %asked, {near}",
        "%index.one = insertelement " + f"{w} poison, i64 %index, i32 0",
        f"%index.all = shufflevector {w} %index.one, {w} poison, <{width} x i32> zeroinitializer",
        f"%index.after = add {w} %index.all, {splat('i64', 1)}",
        f"%code = select {m} %zero, {w} {splat('i64', SINGULAR)}, {w} {splat('i64', OVERFLOW)}",
        *store("status.s", w, "i64", "%status.a, i64 %at", "%code", "%ended"),
        *store("failed.s", w, "i64", "%failed.a, i64 %at", "%index.after", "%ended"),
        *load("near", w, "i64", "%near.a, i64 %at", "zeroinitializer"),
        f"%near.more = add {w} %near, {splat('i64', 1)}",
        *store("near.s", w, "i64", "%near.a, i64 %at", "%near.more", "%close"),
        f"%near.none = icmp eq {w} %near, zeroinitializer",
        f"%near.first = and {m} %near.none, %close",
        *store("nearat.s", w, "i64", "%nearat.a, i64 %at", "%index.all", "%near.first"),
        f"%dead.more = or {m} %dead, %ended",
    ]
    for i in rows:
        lines.append(f"%k{i} = select {m} %fine, {v} {image[i]}, {v} {again[i]}")
        lines.append(f"%e{i} = select {m} %ended, {v} zeroinitializer, {v} %k{i}")
    lines += ["br label %stepped", "stepped:"]
    lines += [f"%y{i} = phi {v} [{image[i]}, %loop], [%e{i}, %careful]" for i in rows]
    lines += [
        f"%dead.after = phi {m} [%dead, %loop], [%dead.more, %careful]",
        "%index.next = add i64 %index, 1",
        "%left.next = sub i64 %left, 1",
        "br label %ask0",
    ]
    for t in (0, 1):
        lines += [
            f"ask{t}:",
            f"%wait{t}.less = sub i64 %wait{t}, 1",
            f"%due{t} = icmp eq i64 %wait{t}.less, 0",
            f"br i1 %due{t}, label %keep{t}, label %kept{t}",
            f"keep{t}:",
        ]
        for i in rows:
            lines += [f"%s{t}.{i}.r = mul i64 %n, {i}", f"%s{t}.{i}.o = add i64 %s{t}.{i}.r, %place{t}"]
            lines += store(f"s{t}.{i}", v, "double", f"%table{t}, i64 %s{t}.{i}.o", f"%y{i}", "%there")
        lines += [
            f"%record{t} = mul i64 %n, {len(rows)}",
            f"%place{t}.far = add i64 %place{t}, %record{t}",
            f"br label %kept{t}",
            f"kept{t}:",
            f"%wait{t}.next = phi i64 [%wait{t}.less, %ask{t}], [%every{t}, %keep{t}]",
            f"%place{t}.next = phi i64 [%place{t}, %ask{t}], [%place{t}.far, %keep{t}]",
            f"br label %{'ask1' if t == 0 else 'next'}",
        ]
    lines += [
        "next:",
        "%more = icmp ne i64 %left.next, 0",
        "br i1 %more, label %loop, label %finish",
        "finish:",
    ]
    for i in rows:
        lines.append(f"%r{i} = select {m} %dead.after, {v} zeroinitializer, {v} %y{i}")
        lines += store(f"r{i}.s", v, "double", f"%z, i64 %z{i}.o", f"%r{i}", "%there")
    lines += [
        f"%at.next = add i64 %at, {width}",
        "%again = icmp slt i64 %at.next, %high",
        "br i1 %again, label %vector, label %end",
        "end: ret void",
        "}",
        '!0 = !{!"branch_weights", i32 1000000, i32 1}',
    ]
    return "\n".join(lines)
