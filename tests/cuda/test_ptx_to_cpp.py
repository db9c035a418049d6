# SPDX-License-Identifier: Apache-2.0
"""Checks that the translator refuses unwanted instructions, so that a kernel with them cannot pass the other tests."""
import unittest

from ptx_to_cpp import Refused, translate

KERNEL = """.version 7.0
.target sm_75
.visible .entry kernel(.param .u64 kernel_param_0)
{
  .reg .f32 %f<4>;
  .reg .b64 %rd<2>;
  ld.param.u64 %rd1, [kernel_param_0];
  ld.global.f32 %f1, [%rd1];
  STATEMENT
  st.global.f32 [%rd1+4], %f2;
  ret;
}
"""


def kernel_with(statement, **options):
    return translate(KERNEL.replace("STATEMENT", statement), **options)


class Translator(unittest.TestCase):
    def test_accepts_arithmetic_that_is_exact_everywhere(self):
        for statement in ["add.rn.f32 %f2, %f1, %f1;", "div.rn.f32 %f2, %f1, %f1;", "sqrt.rn.f32 %f2, %f1;",
                          "fma.rn.f32 %f2, %f1, %f1, %f1;", "neg.f32 %f2, %f1;", "mov.f32 %f2, 0f3F800000;"]:
            self.assertIn("kernel", kernel_with(statement))

    def test_refuses_approximations_and_flushed_denormals(self):
        for statement in ["sqrt.approx.f32 %f2, %f1;", "div.full.f32 %f2, %f1, %f1;", "ex2.approx.f32 %f2, %f1;",
                          "add.rn.ftz.f32 %f2, %f1, %f1;", "div.approx.ftz.f32 %f2, %f1, %f1;"]:
            with self.assertRaisesRegex(Refused, "inexact arithmetic"):
                kernel_with(statement)

    def test_refuses_what_may_still_be_contracted_or_is_rounded_otherwise(self):
        for statement in ["add.f32 %f2, %f1, %f1;", "mul.f32 %f2, %f1, %f1;", "mul.rz.f32 %f2, %f1, %f1;"]:
            with self.assertRaisesRegex(Refused, "contracted or rounded"):
                kernel_with(statement)
        self.assertIn("kernel", kernel_with("add.f32 %f2, %f1, %f1;", allow_contraction=True))

    def test_refuses_calls_that_nothing_in_the_file_answers(self):
        with self.assertRaisesRegex(Refused, "not in this file"):
            kernel_with("call.uni (%f2), powf, (%f1, %f1);")

    def test_refuses_what_it_does_not_know_and_says_where(self):
        with self.assertRaisesRegex(Refused, "kernel: bar.sync 0"):
            kernel_with("bar.sync 0;")
        with self.assertRaisesRegex(Refused, "atom"):
            kernel_with("atom.global.add.f32 %f2, [%rd1], %f1;")

    def test_accepts_shared_variables_only_if_they_are_volatile(self):
        def with_shared(statement):
            return translate(".shared .align 4 .u32 word;\n" + KERNEL.replace("STATEMENT", statement))
        self.assertIn("alignas(4) static thread_local std::byte word[4];",
                      with_shared("ld.volatile.shared.f32 %f2, [word];\n  st.volatile.shared.f32 [word], %f1;"))
        for statement in ["ld.shared.f32 %f2, [word];", "st.shared.f32 [word], %f1;", "cvta.shared.u64 %rd1, word;"]:
            with self.assertRaisesRegex(Refused, "shared memory"):
                with_shared(statement)
        self.assertIn("alignas(4) static thread_local std::byte word[4];",
                      kernel_with(".shared .align 4 .u32 word;\n  st.volatile.shared.f32 [word], %f1;"))

    def test_knows_the_clock(self):
        self.assertIn("ptx::readClock()", kernel_with("mov.u32 %f2, %clock;"))

    def test_counts_instructions_and_loads_only_when_asked(self):
        statement = "@%p1 bra END;\n  ld.v2.f32 {%f2, %f3}, [%rd1];\nEND:"
        text = KERNEL.replace("STATEMENT", statement).replace(".reg .f32", ".reg .pred %p<2>;\n  .reg .f32")
        self.assertNotIn("count", translate(text))
        counted = translate(text, count=True)
        self.assertIn('#include "tests/cuda/ptx_counts.h"', counted)
        self.assertEqual(counted.count("++ptx::counts.instructions; "), 6)
        self.assertIn("++ptx::counts.instructions; if (p1) { goto END; }", counted)
        # The parameter is not loaded from memory.
        self.assertEqual([part.split(")")[0] for part in counted.split("countLoad(")[1:]],
                         ["thread, at, 4", "thread, at, 8"])

    def test_leaves_out_kernels_of_other_names_but_no_functions(self):
        other = KERNEL.replace("STATEMENT", "").replace("kernel", "other")
        function = ".func helper()\n{\n  ret;\n}\n"
        text = KERNEL.replace("STATEMENT", "") + function + other.split(".target sm_75")[1]
        self.assertEqual([name in translate(text) for name in ('"kernel"', '"other"')], [True, True])
        chosen = translate(text, only="other")
        self.assertEqual([name in chosen for name in ('"kernel"', '"other"', "// helper")], [False, True, True])


if __name__ == "__main__":
    unittest.main()
