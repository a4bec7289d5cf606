"""Machine code of straight-line programs, compiled by LLVM through llvmlite, which comes with numba (extra `fast`).

The program of a step (straight_line_program.py) is translated to LLVM's intermediate representation for vectors of
orbits, inside a loop over the steps, and compiled in a fraction of a second. (Numba would take 10 to 20 seconds for the
same loop, mostly for its analysis of Python code, and would need a cache on disk.) The loop advances a vector of
orbits, or a single orbit, through all steps in registers. After each step it checks whether the fast step was valid in
all orbits of the vector; orbits in which it was not valid take the careful step, and their status is recorded. Without
fast-math flags no operation is contracted or reordered, so the results are equal to those of numpy.

Machine code is called through ctypes, which releases the interpreter lock, so threads can work on ranges of orbits.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from functools import lru_cache
from string import Template
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]

from kahanmaps.maps.floats.steps import OVERFLOW, SINGULAR, BatchState, FloatStep, RecordTable
from kahanmaps.maps.floats.straight_line_program import StraightLineProgram, Value

_INSTRUCTIONS = {  # $v: type of vectors of numbers; $m: type of vectors of truth values; $s: suffix of vector functions
    **{name: f"f{name} $v {{0}}, {{1}}" for name in ("add", "sub", "mul", "div")},
    **{name: f"fcmp {word} $v {{0}}, {{1}}" for name, word in {"gt": "ogt", "le": "ole", "eq": "oeq"}.items()},
    **{name: f"{name} $m {{0}}, {{1}}" for name in ("and", "or")},
    "neg": "fneg $v {0}",
    "abs": "call $v @llvm.fabs.$s($v {0})",
    "not": "xor $m {0}, $true",
    "select": "select $m {0}, $v {1}, $v {2}",
}
_NEVER = 1 << 62  # a step that no orbit reaches

# The loops over vectors of orbits and over steps. The last vector is padded with orbits that count as ended. Up to two
# tables are filled: a table receives its first record after `until` steps, then a record after every `every` steps.
_LOOPS = Template("""
declare $v @llvm.fabs.$s($v)
declare i1 @llvm.vector.reduce.and.v${width}i1($m)
declare $v @llvm.masked.load.$s.p0(ptr, i32, $m, $v)
declare $w @llvm.masked.load.v${width}i64.p0(ptr, i32, $m, $w)
declare void @llvm.masked.store.$s.p0($v, ptr, i32, $m)
declare void @llvm.masked.store.v${width}i64.p0($w, ptr, i32, $m)
define void @advance(ptr %z, ptr %statuses, ptr %failed_at, ptr %nears, ptr %near_at, i64 %n, i64 %low, i64 %high,
    i64 %first, i64 %steps, ptr %table0, i64 %every0, i64 %until0, ptr %table1, i64 %every1, i64 %until1) {
entry:
  br label %vector
vector:
  %at = phi i64 [%low, %entry], [%at.next, %finish]
  %at.one = insertelement $w poison, i64 %at, i32 0
  %at.all = shufflevector $w %at.one, $w poison, <$width x i32> zeroinitializer
  %orbit = add $w %at.all, $numbers
  %high.one = insertelement $w poison, i64 %high, i32 0
  %high.all = shufflevector $w %high.one, $w poison, <$width x i32> zeroinitializer
  %there = icmp slt $w %orbit, %high.all
  %status.p = getelementptr i64, ptr %statuses, i64 %at
  %failed.p = getelementptr i64, ptr %failed_at, i64 %at
  %near.p = getelementptr i64, ptr %nears, i64 %at
  %near_at.p = getelementptr i64, ptr %near_at, i64 %at
  %status = call $w @llvm.masked.load.v${width}i64.p0(ptr %status.p, i32 8, $m %there, $w $ones)
  %dead.first = icmp ne $w %status, zeroinitializer
  $load
  br label %loop
loop:
  $states
  %dead = phi $m [%dead.first, %vector], [%dead.after, %kept1]
  %index = phi i64 [%first, %vector], [%index.next, %kept1]
  %left = phi i64 [%steps, %vector], [%left.next, %kept1]
  %wait0 = phi i64 [%until0, %vector], [%wait0.next, %kept1]
  %wait1 = phi i64 [%until1, %vector], [%wait1.next, %kept1]
  %place0 = phi i64 [%at, %vector], [%place0.next, %kept1]
  %place1 = phi i64 [%at, %vector], [%place1.next, %kept1]
  $fast
  %fine = or $m $good, %dead
  %all = call i1 @llvm.vector.reduce.and.v${width}i1($m %fine)
  br i1 %all, label %stepped, label %careful, !prof !0
careful:
  $careful
  %repeat = xor $m %fine, $true
  %zero = and $m %repeat, $singular
  %over = and $m %repeat, $overflow
  %close = and $m %repeat, $near
  %ended = or $m %zero, %over
  %dead.more = or $m %dead, %ended
  %code = select $m %zero, $w $codes_singular, $w $codes_overflow
  %index.one = insertelement $w poison, i64 %index, i32 0
  %index.all = shufflevector $w %index.one, $w poison, <$width x i32> zeroinitializer
  %index.after = add $w %index.all, $ones
  %near = call $w @llvm.masked.load.v${width}i64.p0(ptr %near.p, i32 8, $m %there, $w zeroinitializer)
  %near.more = add $w %near, $ones
  %near.none = icmp eq $w %near, zeroinitializer
  %near.first = and $m %near.none, %close
  call void @llvm.masked.store.v${width}i64.p0($w %code, ptr %status.p, i32 8, $m %ended)
  call void @llvm.masked.store.v${width}i64.p0($w %index.after, ptr %failed.p, i32 8, $m %ended)
  call void @llvm.masked.store.v${width}i64.p0($w %near.more, ptr %near.p, i32 8, $m %close)
  call void @llvm.masked.store.v${width}i64.p0($w %index.all, ptr %near_at.p, i32 8, $m %near.first)
  $choose
  br label %stepped
stepped:
  $images
  %dead.after = phi $m [%dead, %loop], [%dead.more, %careful]
  %index.next = add i64 %index, 1
  %left.next = sub i64 %left, 1
  %wait0.less = sub i64 %wait0, 1
  %due0 = icmp eq i64 %wait0.less, 0
  br i1 %due0, label %keep0, label %kept0
keep0:
  $keep0
  %place0.more = add i64 %place0, %record
  br label %kept0
kept0:
  %wait0.next = phi i64 [%wait0.less, %stepped], [%every0, %keep0]
  %place0.next = phi i64 [%place0, %stepped], [%place0.more, %keep0]
  %wait1.less = sub i64 %wait1, 1
  %due1 = icmp eq i64 %wait1.less, 0
  br i1 %due1, label %keep1, label %kept1
keep1:
  $keep1
  %place1.more = add i64 %place1, %record
  br label %kept1
kept1:
  %wait1.next = phi i64 [%wait1.less, %kept0], [%every1, %keep1]
  %place1.next = phi i64 [%place1, %kept0], [%place1.more, %keep1]
  %more = icmp ne i64 %left.next, 0
  br i1 %more, label %loop, label %finish
finish:
  $store
  %at.next = add i64 %at, $width
  %again = icmp slt i64 %at.next, %high
  br i1 %again, label %vector, label %end
end:
  ret void
}
!0 = !{!"branch_weights", i32 1000000, i32 1}
""")


class MachineCode:
    """The machine code of a step for vectors of `width` orbits."""

    def __init__(self, step: FloatStep, width: int) -> None:
        if step.fast_code is None or step.careful_code is None:
            raise ValueError("machine code requires a fast and a careful straight-line program")
        rows = range(step.rows)

        def splat(kind: str, value: Any) -> str:
            return "<" + ", ".join([f"{kind} {value}"] * width) + ">"

        def constant(x: Any) -> str:
            if isinstance(x, bool):
                return splat("i1", int(x))
            return splat("double", f"0x{struct.unpack('<Q', struct.pack('<d', float(x)))[0]:016X}")

        def translate(code: StraightLineProgram, prefix: str) -> tuple[str, list[str]]:
            """Return the instructions of a program, and the names of its outputs."""

            def name(x: Any) -> str:
                if not isinstance(x, Value):
                    return constant(x)
                return f"%x{x.number}" if x.number < code.inputs else f"%{prefix}{x.number}"

            lines = []
            for k, (operation, operands) in enumerate(code.operations, code.inputs):
                x = [name(operand) for operand in operands]
                if operation in ("max", "min"):
                    lines.append(f"%{prefix}{k}.c = fcmp {'ugt' if operation == 'max' else 'ult'} $v {x[0]}, {x[1]}")
                    x, operation = [f"%{prefix}{k}.c", *x], "select"
                lines.append(f"%{prefix}{k} = {_INSTRUCTIONS[operation].format(*x)}")
            return "\n".join(lines), [name(x) for x in code.outputs]

        def repeat_for_rows(*lines: str) -> str:
            """Repeat lines for each row i of a state; {fast} and {careful} stand for its images in these two steps."""
            return "\n".join(
                line.format(i=i, fast=fast_image[i], careful=careful_image[i]) for i in rows for line in lines
            )

        def store_rows(name: str, table: str, index: str, value: str) -> str:
            return repeat_for_rows(
                f"%{name}{{i}}.r = mul i64 %n, {{i}}",
                f"%{name}{{i}}.o = add i64 %{name}{{i}}.r, {index}",
                f"%{name}{{i}}.p = getelementptr double, ptr {table}, i64 %{name}{{i}}.o",
                f"call void @llvm.masked.store.$s.p0($v {value}, ptr %{name}{{i}}.p, i32 8, $m %there)",
            )

        fast_code, (*fast_image, good) = translate(step.fast_code, "f")
        careful_code, (*careful_image, near, singular, overflow) = translate(step.careful_code, "c")
        sections = {
            "load": f"%record = mul i64 %n, {step.rows}\n"
            + repeat_for_rows(
                "%z{i}.r = mul i64 %n, {i}",
                "%z{i}.o = add i64 %z{i}.r, %at",
                "%z{i}.p = getelementptr double, ptr %z, i64 %z{i}.o",
                "%z{i} = call $v @llvm.masked.load.$s.p0(ptr %z{i}.p, i32 8, $m %there, $v zeroinitializer)",
            ),
            "states": repeat_for_rows("%x{i} = phi $v [%z{i}, %vector], [%y{i}, %kept1]"),
            "fast": fast_code,
            "careful": careful_code,
            "choose": repeat_for_rows(
                "%k{i} = select $m %fine, $v {fast}, $v {careful}",
                "%e{i} = select $m %ended, $v zeroinitializer, $v %k{i}",
            ),
            "images": repeat_for_rows("%y{i} = phi $v [{fast}, %loop], [%e{i}, %careful]"),
            "keep0": store_rows("s", "%table0", "%place0", "%y{i}"),
            "keep1": store_rows("t", "%table1", "%place1", "%y{i}"),
            "store": repeat_for_rows("%r{i} = select $m %dead.after, $v zeroinitializer, $v %y{i}")
            + "\n"
            + store_rows("u", "%z", "%at", "%r{i}"),
        }
        llvm_types = {"v": f"<{width} x double>", "m": f"<{width} x i1>", "w": f"<{width} x i64>", "s": f"v{width}f64"}
        llvm_types |= {"true": splat("i1", 1), "ones": splat("i64", 1), "width": str(width), "good": good, "near": near}
        llvm_types |= {"codes_singular": splat("i64", SINGULAR), "codes_overflow": splat("i64", OVERFLOW)}
        llvm_types |= {"numbers": "<" + ", ".join(f"i64 {k}" for k in range(width)) + ">"}
        llvm_types |= {"singular": singular, "overflow": overflow}
        text = Template(_LOOPS.safe_substitute(sections)).substitute(llvm_types)
        self._engine, self._advance_function = _compile(text)

    def advance(
        self, batch: BatchState, low: int, high: int, first: int, steps: int, tables: Sequence[RecordTable]
    ) -> None:
        """Advance the orbits low, ..., high - 1 by `steps` steps from step `first`, with at most two tables."""
        records: list[Any] = []
        for interval, states in tables:
            records += [states.ctypes.data, interval, interval - first % interval]
        records += [None, _NEVER, _NEVER] * (2 - len(tables))
        arrays = (array.ctypes.data for array in batch)
        self._advance_function(*arrays, batch.z.shape[1], low, high, first, steps, *records)


@lru_cache(maxsize=32)
def _compile(text: str) -> tuple[Any, Any]:
    """Compile the text of an LLVM module; return the engine that owns the machine code, and the function `advance`."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    target_machine = llvm.Target.from_default_triple().create_target_machine(llvm.get_host_cpu_name(), features, opt=2)
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = target_machine.triple, str(target_machine.target_data)
    module.verify()
    engine = llvm.create_mcjit_compiler(module, target_machine)  # the engine takes ownership of the target machine
    engine.finalize_object()
    types = [ctypes.c_void_p] * 5 + [ctypes.c_int64] * 5 + [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64] * 2
    return engine, ctypes.CFUNCTYPE(None, *types)(engine.get_function_address("advance"))
