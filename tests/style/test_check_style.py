"""Every rule of check_style.py finds a planted breach, with its line, and lets the innocent neighbour pass."""

import json
import pathlib
import tempfile
import unittest

from check_style import breaches


class CheckStyle(unittest.TestCase):
    def found(self, files, compiled=None):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            commands = None
            if compiled is not None:
                commands = root / "compile_commands.json"
                commands.write_text(json.dumps([{"directory": str(root), "file": f} for f in compiled]))
            return breaches(root, commands)

    def assert_breach(self, path, line, code, rule):
        found = self.found({path: "\n" * (line - 1) + code + "\n"})
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(f"{path}:{line}: {rule}"), found[0])

    def assert_clean(self, path, code):
        self.assertEqual(self.found({path: code}), [])

    def test_includes_against_the_direction(self):
        self.assert_breach("server/core/a.cpp", 3, '#include "client/core/b.hpp"', "layers")
        self.assert_breach("client/core/a.hpp", 2, '#include <server/core/b.hpp>', "layers")
        self.assert_breach("common/patch/a.hpp", 1, '#include "server/dynamics/b.hpp"', "layers")
        self.assert_breach("client/app/a.cpp", 1, '#include "bench/world/b.hpp"', "layers")
        self.assert_breach("bench/lab/a.cpp", 1, '#include "bindings/core/b.hpp"', "layers")
        self.assert_breach("server/core/a.cpp", 1, '#include "../../client/core/b.hpp"', "layers")
        self.assert_clean("bench/world/a.cpp", '#include "client/core/b.hpp"\n#include "server/core/c.hpp"\n')
        self.assert_clean("server/core/a.cpp", '#include "common/wire/b.hpp"\n// #include "client/core/b.hpp"\n')

    def test_the_operating_system_in_a_core(self):
        for header in ("asio.hpp", "asio/ip/udp.hpp", "GLFW/glfw3.h", "hidapi.h", "thread", "mutex", "iostream", "sys/socket.h", "fstream"):
            self.assert_breach("server/core/a.cpp", 5, f"#include <{header}>", "core")
            self.assert_clean("server/io/a.cpp", f"#include <{header}>\n")
        self.assert_clean("server/scene/a.cpp", "#include <fstream>\n")
        self.assert_clean("client/core/a.cpp", "#include <chrono>\n#include <atomic>\n")

    def test_words_that_gave_way_to_the_fields(self):
        for code in ("// a dent as deep as that", "BodyWays ways;", "class Crew {};", "double bridge_s = 0;", "scheme = \"cubic\";",
                     "// remembered states", "Vector imbalance;", "constexpr double kSeldom = 8;", "// of a graded body", "// pressed in thought",
                     "beat.lives_on = 1;", "// a patch that lives on"):
            self.assert_breach("server/reduction/a.cpp", 3, code, "words")
        self.assert_breach("docs/a.md", 2, "as in the ladder of integrators", "words")
        self.assert_breach("server/room/hand_futures.hpp", 1, "", "words")
        self.assert_clean("docs/notebook.md", "# The ladder, dents and bridges\n")
        self.assert_clean("docs/a.md", "a cubic lattice; see [12](notebook.md)\n")
        self.assert_clean("server/reduction/a.cpp", "// an accident of indentation, independent of the horizon\n")

    def test_comments_without_a_subject(self):
        for code in ("// Of the newest frame.", "/// That the server sent.", "/// What it costs\n/// in the end.", "/// Whether it is done.",
                     "int a;  ///< Where it ends", "/// Who asked.", "/// Whose key it is.", "  // How long it takes.", "/// Which is first."):
            self.assert_breach("server/core/a.hpp", 3, code, "comments")
        self.assertEqual(self.found({"client/core/a.hpp": "int a;  ///< a number\n/// Of the other one.\nint b;\n"}),
                         ['client/core/a.hpp:2: comments: begins with "Of"; say what the thing is'])
        self.assert_clean("server/core/a.hpp", "/// Largest change of the force per tick [N].\n/// What lies beyond is clamped.\ndouble a;\n")
        self.assert_clean("server/core/a.hpp", "// Whether to send it, and where:\n// who decides? The room does.\n")
        self.assert_clean("server/core/a.hpp", "/// Offset of the clock.\nconst char* s = \"// Of which\";  ///< of a clock\n")
        self.assert_clean("server/core/a.cpp", "// Of the newest frame.\n")

    def test_phrases_at_which_a_reader_stumbles(self):
        for text in ("It takes the patch in the place of the force.", "A truer patch", "the force goes on", "As far as they are known."):
            self.assert_breach("docs/a.md", 4, text, "phrases")
            self.assert_breach("server/dynamics/a.cpp", 2, f"int x;  // {text}", "phrases")
        self.assert_breach("server/dynamics/a.hpp", 2, "/// A patch that takes over in the\n/// place of another one.", "phrases")
        self.assert_clean("docs/notebook.md", "what is dearer goes on\n")
        self.assert_clean("server/dynamics/a.cpp", 'const char* goes_on = "it goes on";  // what goes on top\nint truer = 1;\n')
        self.assert_clean("server/dynamics/a.py", "# in the place of\n")

    def test_two_types_of_one_name(self):
        types = "namespace palpate {\n\nstruct A {\n  int x;\n};\n\nnamespace {\n\nclass B : public A {\n};\n\n}  // namespace\n\n}  // namespace palpate\n"
        other = "namespace palpate {\nclass A final : public C {\n};\n}  // namespace palpate\n"
        self.assertEqual(self.found({"client/core/a.hpp": types, "server/core/b.cpp": other}),
                         ["server/core/b.cpp:2: names: client/core/a.hpp:3 has a type A too"])
        self.assertEqual(self.found({"client/core/a.cpp": types, "tests/core/b.cpp": other}),
                         ["tests/core/b.cpp:2: names: client/core/a.cpp:3 has a type A too"])
        self.assertEqual(self.found({"tests/core/a.cpp": other, "tests/server/dynamics/b.cpp": other}), [])
        self.assertEqual(len(self.found({"tests/core/a.cpp": other, "tests/core/b.cpp": other})), 1)
        for innocent in ("namespace palpate::pack {\nstruct A {\n};\n}  // namespace palpate::pack\n",
                         "namespace palpate {\nstruct A;\nstruct A::D {\n};\nstruct B {\n  struct A {\n  };\n};\n}  // namespace palpate\n"):
            self.assertEqual(self.found({"client/core/a.hpp": types, "server/core/b.cpp": innocent}), [])

    def test_names_of_tests(self):
        self.assert_breach("tests/common/io/a.cpp", 2, 'TEST_CASE("it stalls; lines are left out") {', "tests")
        self.assert_clean("tests/common/io/a.cpp", 'TEST_CASE("it stalls") {\n  CHECK(text == "a;b");\n}\n')

    def test_clocks_in_a_core(self):
        self.assert_breach("client/core/a.cpp", 4, "auto t = std::chrono::steady_clock::now();", "core")
        self.assert_breach("common/link/a.cpp", 1, "std::random_device seed;", "core")
        self.assert_clean("client/io/a.cpp", "auto t = std::chrono::steady_clock::now();\n")
        self.assert_clean("client/core/a.cpp", '// steady_clock::now()\nconst char* s = "steady_clock::now()"; auto d = 1\'000\'000;\n')

    def test_algorithms_whose_buffers_are_not_aligned(self):
        for code in ("std::stable_sort(a.begin(), a.end());", "std::ranges::stable_partition(a, f);", "std::inplace_merge(a, b, c);"):
            self.assert_breach("client/view/a.cpp", 3, code, "alignment")
            self.assert_breach("tests/client/view/a.cpp", 3, code, "alignment")
            self.assert_clean("common/base/sort_stably.hpp", code + "\n")
        self.assert_clean("client/view/a.cpp", "std::sort(a.begin(), a.end());  // std::stable_sort\n")

    def test_banned_calls_in_the_tick(self):
        path = "client/guard/guard.cpp"
        for code in ("auto* p = new Vec3;", "void* p = malloc(8);", "std::function<void()> f;", "std::lock_guard lock(m);", "throw 1;",
                     'std::cerr << "x";', 'std::string s = "x";', "auto s = std::to_string(1);", "auto p = std::make_unique<int>(1);"):
            self.assert_breach(path, 7, code, "real time")
            self.assert_clean("server/dynamics/a.cpp", code + "\n")
        self.assert_clean(path, "// a new patch may throw the hand off\nstd::string_view s; int renewed = 0; /* throw */\n")

    def test_a_test_that_nothing_compiles(self):
        files = {"tests/common/patch/a.cpp": "", "tests/common/patch/b.cpp": ""}
        found = self.found(files, compiled=["tests/common/patch/a.cpp"])
        self.assertEqual([f for f in found if f.startswith("tests/")], ["tests/common/patch/b.cpp:1: tests: no target compiles this file"])

    def test_work_left_over(self):
        self.assert_breach("docs/a.md", 2, "TO" + "DO: write this", "words")
        self.assert_breach("server/dynamics/a.cpp", 9, "int x;  // FIX" + "ME", "words")


if __name__ == "__main__":
    unittest.main()
