#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ptx_to_cpp.py IN.ptx OUT.cpp [--allow-contraction] [--count] [--only TEXT]

Turns compiled kernels into C++ that runs them on a CPU, a statement for every instruction (ptx_machine.h has what
they are built from). With --count, it also counts what it executes (ptx_counts.h); with --only, kernels whose names do
not contain the text are left out. Refuses arithmetic whose bits depend on the device: approximations, flushed denormals, float
operations that a later stage might contract; and what these kernels have no business with: barriers, atomics, calls of
functions that are not in the file, shared memory except volatile variables. Threads run one after another, so that the
result must not depend on when others write these."""
import argparse
import re
import sys

from ptx_reader import Function, Refused, read_array, read_module, split_commas

CPP_TYPES = {"u8": "std::uint8_t", "s8": "std::int8_t", "u16": "std::uint16_t", "s16": "std::int16_t",
             "u32": "std::uint32_t", "s32": "std::int32_t", "u64": "std::uint64_t", "s64": "std::int64_t",
             "f32": "float", "f64": "double", "pred": "bool"}
WIDER = {"u16": "u32", "s16": "s32", "u32": "u64", "s32": "s64"}
COMPARISONS = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=",
               "lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
# Also true if an operand is NaN: the opposite comparison is false.
UNORDERED = {"neu": "==", "ltu": ">=", "leu": ">", "gtu": "<=", "geu": "<"}
TO_INTEGER = {"rni": "rint", "rzi": "trunc", "rmi": "floor", "rpi": "ceil"}
ROUNDED = {"add", "sub", "mul", "fma", "div", "rcp", "sqrt"}


def plain(type_name):
    """Untyped bits are read as an unsigned number."""
    return "u" + type_name[1:] if type_name[0] == "b" else type_name


def unsigned(type_name):
    return "u" + type_name[1:]


def bits(type_name):
    return int(type_name[1:])


class FunctionTranslator:
    def __init__(self, function: Function, symbols, functions, allow_contraction, count):
        self.function = function
        self.functions = functions  # C++ name of every function that is defined
        self.allow_contraction, self.count = allow_contraction, count
        self.symbols = dict(symbols)  # name in PTX -> C++ expression of type byte*
        for i, parameter in enumerate(function.parameters):
            self.symbols[parameter.name] = f"arguments[{i}]"
        for result in function.result:
            self.symbols[result.name] = "result"
        self.registers = {}  # name or prefix -> type
        self.lines = []
        self.refusals = []

    def translate(self):
        for kind, *text in self.function.statements:
            try:
                if kind == "begin":
                    self.lines.append("{")
                elif kind == "end":
                    self.lines.append("}")
                elif kind == "label":
                    self.lines.append(f"{label(text[0])}:;")
                elif text[0].startswith("."):
                    self.declare(text[0])
                else:
                    # What a guard skips takes a device's time too.
                    counting = "++ptx::counts.instructions; " if self.count else ""
                    self.lines.append(counting + self.statement(text[0]))
            except Refused as refused:
                self.refusals.append(f"{self.function.name}: {text[0]}: {refused}")
        return self.lines

    def declare(self, text):
        if text.startswith(".pragma"):
            return
        register = re.fullmatch(r"\.reg \.(\w+) %?([\w$]+?)(?:<(\d+)>)?", text)
        if register:
            type_name, name, count = register.groups()
            self.registers[name] = type_name
            cpp = "bool" if type_name == "pred" else f"ptx::Register{bits(type_name)}"
            names = [name] if count is None else [f"{name}{i}" for i in range(int(count))]
            self.lines.append(f"{cpp} {', '.join(names)};")
            return
        if not text.startswith((".local", ".param", ".shared")):
            raise Refused("declaration")
        array = read_array(text)
        self.symbols[array.name] = array.name
        if text.startswith(".shared"):
            self.lines.append(shared(array))
            return
        self.lines.append(f"alignas({array.align}) std::byte {array.name}[{array.size}];")
        if text.startswith(".local"):
            self.lines.append(f"const ptx::Frame frame_{array.name}(thread, {array.name});")

    def register_type(self, operand):
        """Type of a register, None for other operands."""
        name = operand.removeprefix("%")
        return self.registers.get(name) or self.registers.get(name.rstrip("0123456789"))

    def value(self, operand, type_name):
        """C++ expression of an operand, read as a type."""
        type_name = plain(type_name)
        register = self.register_type(operand)
        if register == "pred":
            return operand.removeprefix("%")
        if register:
            return f"{operand.removeprefix('%')}.{type_name}"
        special = re.fullmatch(r"%(tid|ntid|ctaid|nctaid)\.([xyz])", operand)
        if special:
            return f"thread.{special.group(1)}.{special.group(2)}"
        if operand == "%clock":
            return "ptx::readClock()"
        if re.fullmatch(r"0[fF][0-9A-Fa-f]{8}", operand):
            return f"ptx::floatOf(0x{operand[2:]}u)"
        if re.fullmatch(r"0[dD][0-9A-Fa-f]{16}", operand):
            return f"ptx::doubleOf(0x{operand[2:]}u)"
        if re.fullmatch(r"-?(0x[0-9A-Fa-f]+|\d+)U?", operand):
            number = int(operand.rstrip("U"), 0)
            return f"{CPP_TYPES[type_name]}({number % 2**64}u)"
        if operand in self.symbols:
            return f"ptx::addressOf({self.symbols[operand]})"
        raise Refused(f"operand {operand}")

    def assign(self, operand, type_name, expression):
        """Stores a value of a type into a register, extended by its sign where the register is wider."""
        if operand == "_":
            return ""
        register = self.register_type(operand)
        name = operand.removeprefix("%")
        if register is None:
            raise Refused(f"destination {operand}")
        if register == "pred":
            return f"{name} = {expression};"
        type_name = plain(type_name)
        if bits(type_name) == bits(register):
            return f"{name}.{type_name} = {expression};"
        if bits(type_name) > bits(register) or type_name[0] == "f":
            raise Refused(f"{type_name} into {register}")
        return f"{name}.{type_name[0]}{bits(register)} = {CPP_TYPES[type_name]}({expression});"

    def address(self, operand):
        match = re.fullmatch(r"\[\s*([^\s+]+)\s*(?:\+\s*(-?\d+))?\s*\]", operand)
        if not match:
            raise Refused(f"address {operand}")
        return f"{self.value(match.group(1), 'u64')} + {int(match.group(2) or 0)}"

    def statement(self, text):
        guarded = re.fullmatch(r"@(!?)%?([\w$]+) (.*)", text)
        if guarded:
            negation, predicate, rest = guarded.groups()
            return f"if ({negation}{predicate}) {{ {self.statement(rest)} }}"
        opcode, _, operands = text.partition(" ")
        name, *modifiers = opcode.split(".")
        if name == "call":
            return self.call(operands)
        self.check_exactness(name, modifiers)
        translate = getattr(self, "do_" + name, None)
        if not translate:
            raise Refused("unknown instruction")
        return translate(modifiers, split_commas(operands))

    def check_exactness(self, name, modifiers):
        if set(modifiers) & {"approx", "ftz", "full"}:
            raise Refused("inexact arithmetic")
        is_float = modifiers and modifiers[-1] in ("f32", "f64")
        if is_float and name in ROUNDED and "rn" not in modifiers:
            if not (self.allow_contraction and name in ("add", "sub", "mul")):
                raise Refused("may be contracted or rounded otherwise")

    def call(self, operands):
        *result, name, arguments = [part.strip("() ") for part in split_commas(operands)]
        if name not in self.functions:
            raise Refused("call of a function that is not in this file")
        passed = ", ".join(self.symbols[argument] for argument in split_commas(arguments))
        return (f"{{ const std::byte* passed[] = {{{passed or 'nullptr'}}}; "
                f"{self.functions[name]}(thread, {result[0] if result else 'nullptr'}, passed); }}")

    # Memory

    def vector(self, modifiers, operand):
        return split_commas(operand[1:-1]) if {"v2", "v4"} & set(modifiers) else [operand]

    def is_unchecked(self, modifiers):
        """Whether an access needs no check because it names a variable."""
        if "shared" in modifiers and "volatile" not in modifiers:
            raise Refused("shared memory that is not volatile")
        return "param" in modifiers or "shared" in modifiers

    def do_ld(self, modifiers, operands):
        type_name = plain(modifiers[-1])
        size = bits(type_name) // 8
        unchecked = self.is_unchecked(modifiers)
        load = "ptx::read" if unchecked else "ptx::load"
        where = "" if unchecked else "thread, "
        code = f"{{ const std::uint64_t at = {self.address(operands[1])}; "
        registers = self.vector(modifiers, operands[0])
        if len(registers) > 1:
            code += f"ptx::checkAlignment(at, {len(registers) * size}); "
        if self.count and not unchecked:
            code += f"ptx::countLoad(thread, at, {len(registers) * size}); "
        for i, register in enumerate(registers):
            code += self.assign(register, type_name, f"{load}<{CPP_TYPES[type_name]}>({where}at + {i * size})")
        return code + " }"

    def do_st(self, modifiers, operands):
        type_name = plain(modifiers[-1])
        size = bits(type_name) // 8
        unchecked = self.is_unchecked(modifiers)
        store = "ptx::write" if unchecked else "ptx::store"
        where = "" if unchecked else "thread, "
        code = f"{{ const std::uint64_t at = {self.address(operands[0])}; "
        registers = self.vector(modifiers, operands[1])
        if len(registers) > 1:
            code += f"ptx::checkAlignment(at, {len(registers) * size}); "
        for i, register in enumerate(registers):
            code += f"{store}<{CPP_TYPES[type_name]}>({where}at + {i * size}, {self.value(register, type_name)}); "
        return code + "}"

    def do_cvta(self, modifiers, operands):
        if "shared" in modifiers:
            raise Refused("address of shared memory")
        return self.assign(operands[0], "u64", self.value(operands[1], "u64"))  # one address space for all

    # Moves and conversions

    def do_mov(self, modifiers, operands):
        to, source = operands
        type_name = plain(modifiers[-1])
        if to.startswith("{"):
            parts = split_commas(to[1:-1])
            width = bits(type_name) // len(parts)
            return "".join(self.assign(part, f"u{width}", f"{self.value(source, type_name)} >> {i * width}")
                           for i, part in enumerate(parts))
        if source.startswith("{"):
            parts = split_commas(source[1:-1])
            width = bits(type_name) // len(parts)
            joined = " | ".join(f"std::uint64_t({self.value(part, f'u{width}')}) << {i * width}"
                                for i, part in enumerate(parts))
            return self.assign(to, type_name, joined)
        return self.assign(to, type_name, self.value(source, type_name))

    def do_cvt(self, modifiers, operands):
        to, source = plain(modifiers[-2]), plain(modifiers[-1])
        rounding = modifiers[:-2]
        value = self.value(operands[1], source)
        if source[0] == "f" and len(rounding) == 1 and rounding[0] in TO_INTEGER:
            value = f"std::{TO_INTEGER[rounding[0]]}({value})"
            if to[0] != "f":
                value = f"ptx::saturate<{CPP_TYPES[to]}>({value})"
        elif to[0] == "f" and rounding != ["rn"] and (to, source) != ("f64", "f32"):
            raise Refused("conversion")
        elif to[0] != "f" and (source[0] == "f" or rounding):
            raise Refused("conversion")
        return self.assign(operands[0], to, f"{CPP_TYPES[to]}({value})")

    def do_selp(self, modifiers, operands):
        type_name = modifiers[-1]
        chosen, other = self.value(operands[1], type_name), self.value(operands[2], type_name)
        return self.assign(operands[0], type_name, f"{self.value(operands[3], 'pred')} ? {chosen} : {other}")

    def do_setp(self, modifiers, operands):
        if len(modifiers) != 2:
            raise Refused("combined comparison")
        comparison, type_name = modifiers
        a, b = self.value(operands[1], type_name), self.value(operands[2], type_name)
        if type_name[0] == "f" and comparison in UNORDERED:
            code = f"!({a} {UNORDERED[comparison]} {b})"
        elif type_name[0] == "f" and comparison in ("nan", "num"):
            code = f"{'!' if comparison == 'num' else ''}({a} != {a} || {b} != {b})"
        elif type_name[0] == "f" and comparison in ("ne", "equ"):
            code = f"{'!' if comparison == 'equ' else ''}({a} < {b} || {a} > {b})"
        elif comparison in COMPARISONS:
            code = f"{a} {COMPARISONS[comparison]} {b}"
        else:
            raise Refused("comparison")
        return self.assign(operands[0], "pred", code)

    # Arithmetic. Integers wrap around, so they are computed unsigned.

    def binary(self, modifiers, operands, operator):
        type_name = modifiers[-1] if modifiers[-1][0] == "f" or modifiers[-1] == "pred" else unsigned(modifiers[-1])
        return self.assign(operands[0], type_name,
                           f"{self.value(operands[1], type_name)} {operator} {self.value(operands[2], type_name)}")

    def do_add(self, modifiers, operands):
        return self.binary(modifiers, operands, "+")

    def do_sub(self, modifiers, operands):
        return self.binary(modifiers, operands, "-")

    def do_and(self, modifiers, operands):
        return self.binary(modifiers, operands, "&")

    def do_or(self, modifiers, operands):
        return self.binary(modifiers, operands, "|")

    def do_xor(self, modifiers, operands):
        return self.binary(modifiers, operands, "^")

    def product(self, modifiers, operands):
        """Type and expression of an integer product."""
        type_name = plain(modifiers[-1])
        a, b = self.value(operands[1], type_name), self.value(operands[2], type_name)
        if "wide" in modifiers:
            wider = WIDER[type_name]
            return wider, f"{CPP_TYPES[wider]}({a}) * {b}"
        if "hi" in modifiers and type_name in WIDER:
            wider = WIDER[type_name]
            return type_name, f"{CPP_TYPES[type_name]}(({CPP_TYPES[wider]}({a}) * {b}) >> {bits(type_name)})"
        if "lo" in modifiers:
            wrapped = unsigned(type_name)
            return wrapped, f"{self.value(operands[1], wrapped)} * {self.value(operands[2], wrapped)}"
        raise Refused("product")

    def do_mul(self, modifiers, operands):
        if modifiers[-1][0] == "f":
            return self.binary(modifiers, operands, "*")
        return self.assign(operands[0], *self.product(modifiers, operands))

    def do_mad(self, modifiers, operands):
        type_name, product = self.product(modifiers, operands)
        wrapped = unsigned(type_name)
        return self.assign(operands[0], wrapped,
                           f"{CPP_TYPES[wrapped]}({product}) + {self.value(operands[3], wrapped)}")

    def do_fma(self, modifiers, operands):
        a, b, c = (self.value(operand, modifiers[-1]) for operand in operands[1:])
        return self.assign(operands[0], modifiers[-1], f"std::fma({a}, {b}, {c})")

    def do_div(self, modifiers, operands):
        a, b = (self.value(operand, modifiers[-1]) for operand in operands[1:])
        return self.assign(operands[0], modifiers[-1], f"{a} / {b}")

    def do_rem(self, modifiers, operands):
        a, b = (self.value(operand, modifiers[-1]) for operand in operands[1:])
        return self.assign(operands[0], modifiers[-1], f"{a} % {b}")

    def do_rcp(self, modifiers, operands):
        return self.assign(operands[0], modifiers[-1], f"1 / {self.value(operands[1], modifiers[-1])}")

    def do_sqrt(self, modifiers, operands):
        return self.assign(operands[0], modifiers[-1], f"std::sqrt({self.value(operands[1], modifiers[-1])})")

    def do_neg(self, modifiers, operands):
        type_name = modifiers[-1] if modifiers[-1][0] == "f" else unsigned(modifiers[-1])
        return self.assign(operands[0], type_name, f"-{self.value(operands[1], type_name)}")

    def do_abs(self, modifiers, operands):
        if modifiers[-1][0] != "f":
            raise Refused("unknown instruction")
        return self.assign(operands[0], modifiers[-1], f"std::fabs({self.value(operands[1], modifiers[-1])})")

    def do_not(self, modifiers, operands):
        operator = "!" if modifiers[-1] == "pred" else "~"
        return self.assign(operands[0], modifiers[-1], f"{operator}{self.value(operands[1], modifiers[-1])}")

    def do_min(self, modifiers, operands):
        a, b = (self.value(operand, modifiers[-1]) for operand in operands[1:])
        return self.assign(operands[0], modifiers[-1], f"ptx::minimum({a}, {b})")

    def do_max(self, modifiers, operands):
        a, b = (self.value(operand, modifiers[-1]) for operand in operands[1:])
        return self.assign(operands[0], modifiers[-1], f"ptx::maximum({a}, {b})")

    def do_shl(self, modifiers, operands):
        type_name = plain(modifiers[-1])
        return self.assign(operands[0], type_name,
                           f"ptx::shiftLeft({self.value(operands[1], type_name)}, {self.value(operands[2], 'u32')})")

    def do_shr(self, modifiers, operands):
        type_name = plain(modifiers[-1])
        return self.assign(operands[0], type_name,
                           f"ptx::shiftRight({self.value(operands[1], type_name)}, {self.value(operands[2], 'u32')})")

    def do_brev(self, modifiers, operands):
        return self.assign(operands[0], modifiers[-1], f"ptx::reverseBits({self.value(operands[1], modifiers[-1])})")

    def do_bfi(self, modifiers, operands):
        type_name = plain(modifiers[-1])
        field, into = (self.value(operand, type_name) for operand in operands[1:3])
        position, length = (self.value(operand, "u32") for operand in operands[3:5])
        return self.assign(operands[0], type_name, f"ptx::insertBits({field}, {into}, {position}, {length})")

    def do_shf(self, modifiers, operands):
        if modifiers not in (["l", "wrap", "b32"], ["r", "wrap", "b32"]):
            raise Refused("funnel shift that is not of 32 bits and wrapping")
        low, high, by = (self.value(operand, "u32") for operand in operands[1:4])
        name = "funnelLeft" if modifiers[0] == "l" else "funnelRight"
        return self.assign(operands[0], "u32", f"ptx::{name}({low}, {high}, {by})")

    def do_popc(self, modifiers, operands):
        count = f"std::popcount({self.value(operands[1], plain(modifiers[-1]))})"
        return self.assign(operands[0], "u32", f"std::uint32_t({count})")

    # Control

    def do_bra(self, modifiers, operands):
        return f"goto {label(operands[0])};"

    def do_ret(self, modifiers, operands):
        return "return;"

    do_exit = do_ret


def shared(array):
    """Declaration of a variable in shared memory. A thread of the host runs one block at a time; the next one finds
    what the last one has left, as on a device."""
    return f"alignas({array.align}) static thread_local std::byte {array.name}[{array.size}];"


def label(name):
    return name.replace("$", "")


def translate(text, allow_contraction=False, count=False, only=""):
    """C++ of a module's functions and a table of its kernels. Raises Refused, which names all refused statements."""
    module = read_module(text)
    defined = [function for function in module.functions
               if function.defined and (only in function.name or not function.is_kernel)]
    names = {function.name: f"function{i}" for i, function in enumerate(defined)}
    symbols = {table.name: f"table_{table.name}" for table in module.tables}
    symbols |= {array.name: array.name for array in module.shared}
    out = [f'#include "tests/cuda/{"ptx_counts" if count else "ptx_machine"}.h"', "", "namespace {"]
    for table in module.tables:
        out.append(f"alignas({table.align}) {CPP_TYPES[plain(table.element)]} table_{table.name}"
                   f"[{table.size // (bits(table.element) // 8)}] = {{{table.values}}};")
        out.append(f"const ptx::Table register_{table.name}(table_{table.name});")
    out += [shared(array) for array in module.shared]
    signature = "(ptx::Thread& thread, std::byte* result, const std::byte* const* arguments)"
    out += [f"void {name}{signature};" for name in names.values()]
    refusals = []
    for function in defined:
        translator = FunctionTranslator(function, symbols, names, allow_contraction, count)
        lines = translator.translate()
        refusals += translator.refusals
        out += ["", f"// {function.name}", f"void {names[function.name]}{signature} {{",
                "(void)thread, (void)result, (void)arguments;", *lines, "}"]
        if function.is_kernel:
            sizes = ", ".join(str(parameter.size) for parameter in function.parameters)
            out.append(f'const ptx::Kernel kernel_{names[function.name]}("{function.name}", {names[function.name]}, '
                       f"{{{sizes}}}, {function.max_threads});")
    if refusals:
        raise Refused("\n".join(refusals))
    return "\n".join(out + ["}  // namespace", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", metavar="IN.ptx")
    parser.add_argument("target", metavar="OUT.cpp")
    parser.add_argument("--allow-contraction", action="store_true")
    parser.add_argument("--count", action="store_true")
    parser.add_argument("--only", metavar="TEXT", default="")
    options = parser.parse_args()
    try:
        with open(options.source, encoding="utf-8") as file:
            code = translate(file.read(), options.allow_contraction, options.count, options.only)
    except Refused as refused:
        sys.exit(f"{options.source}: refused:\n{refused}")
    with open(options.target, "w", encoding="utf-8") as file:
        file.write(code)


if __name__ == "__main__":
    main()
