// The files around recordings, on a real file system.
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/base/error.hpp"
#include "common/io/mapped_file.hpp"
#include "common/io/record_file.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

namespace {

/// An empty folder that is removed at the end.
struct Folder {
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "palpate-record-XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()));
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

std::string error_of(const std::filesystem::path& file) {
  try {
    RecordFile(std::string("--record"), file, std::vector<std::byte>(10));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a recording that was written behind is there when its file is closed", "[record]") {
  const Folder folder;
  const auto file = folder.path / "a.rec";
  RecordingWriter writer(test::small_head());
  {
    RecordFile out("--record", file, writer.take());
    for (int k = 0; k < 200; ++k) {
      test::add_small_frame(writer, k);
      out.write(writer.take());
    }
    writer.finish();
    out.write(writer.take());
    CHECK_FALSE(out.fault());
  }
  const MappedFile mapped(file);
  CHECK(mapped.bytes().size() == writer.bytes());
  const RecordingReader recording(mapped.bytes(), "a.rec");
  CHECK(recording.complete());
  CHECK(recording.end() == test::small_touch(199).t);
}

TEST_CASE("a file that is there, a folder that cannot be made and a full disk are bad input at the start", "[record]") {
  const Folder folder;
  const auto there = folder.path / "there.rec";
  std::ofstream(there) << "precious";
  CHECK(error_of(there) == "--record " + there.string() + ": is there already; expected a file that is not there yet");
  CHECK(std::filesystem::file_size(there) == 8);
  CHECK_THAT(error_of(there / "in" / "a_file.rec"), Catch::Contains("cannot be made: Not a directory; expected a folder"));
  CHECK_THAT(error_of(folder.path), Catch::Contains("cannot be made: Is a directory"));
  CHECK_THAT(error_of("/dev/full"), Catch::Contains("cannot be written: No space left on device; expected room on the disk"));
  CHECK_THROWS_AS(MappedFile(folder.path / "nothing.rec"), InputError);
  CHECK_THROWS_AS(MappedFile(folder.path), InputError);
}

TEST_CASE("a file whose head does not fit on the disk is taken away again, and a device is not", "[record]") {
  const Folder folder;
  const auto file = folder.path / "cut.rec";
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const rlimit tight{100, before.rlim_max};
  const auto of_signal = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &tight) == 0);
  std::string said;
  try {
    RecordFile("--record", file, std::vector<std::byte>(1000));
  } catch (const InputError& fault) {
    said = fault.what();
  }
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  std::signal(SIGXFSZ, of_signal);
  CHECK_THAT(said, Catch::Contains("cannot be written: File too large"));
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK_THAT(error_of("/dev/full"), Catch::Contains("cannot be written"));
  CHECK(std::filesystem::exists("/dev/full"));
}

TEST_CASE("a file that cannot grow any more is said to, once, and keeps what it has", "[record]") {
  const Folder folder;
  const auto file = folder.path / "full.rec";
  const rlim_t most = 40'000;
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const rlimit tight{most, before.rlim_max};
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &tight) == 0);
  RecordingWriter writer(test::small_head());
  std::string fault;
  {
    RecordFile out("--record", file, writer.take());
    for (int k = 0; k < 400; ++k) {
      test::add_small_frame(writer, k);
      out.write(writer.take());
    }
    while (fault.empty()) {
      if (auto said = out.fault()) fault = *said;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    out.write(std::vector<std::byte>(100));
    CHECK_FALSE(out.fault());
  }
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  CHECK(fault == file.string() + ": the recording ends here, the session goes on: File too large");
  const MappedFile mapped(file);
  CHECK(mapped.bytes().size() <= most);
  const RecordingReader recording(mapped.bytes(), "full.rec");
  CHECK_FALSE(recording.complete());
  CHECK(recording.blocks().size() > 1);
}

TEST_CASE("a disk that fails to take what was written is said, once, also at the very end", "[record]") {
  const Folder folder;
  const std::vector<std::byte> some(100);
  RecordFile at_end("--record", folder.path / "a.rec", some, [](int) { return EIO; });
  at_end.write(some);
  const auto fault = at_end.close();
  REQUIRE(fault);
  CHECK(fault->find("a.rec: the recording ends here, the session goes on: what was written did not reach the disk") !=
        std::string::npos);
  CHECK(at_end.failed());
  CHECK_FALSE(at_end.close());
  CHECK(at_end.written() == 200);

  RecordFile sound("--record", folder.path / "b.rec", some, [](int) { return 0; });
  sound.write(some);
  CHECK_FALSE(sound.close());
  CHECK_FALSE(sound.failed());
}

TEST_CASE("a file that is removed under its recording is said, once", "[record]") {
  const Folder folder;
  const std::vector<std::byte> some(100);
  const auto file = folder.path / "gone.rec";
  RecordFile out("--record", file, some);
  std::filesystem::remove(file);
  std::string fault;
  while (fault.empty()) {
    out.write(some);
    if (auto said = out.fault()) fault = *said;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(fault == file.string() + ": the recording ends here, the session goes on: the file was removed");
  CHECK_FALSE(out.close());
}

TEST_CASE("a series that another program writes is not gone on with", "[record]") {
  const Folder folder;
  const std::vector<std::byte> some(100);
  const auto file = folder.path / "a.rec";
  {
    RecordFile first("--record", file, some);
    CHECK_THROWS_WITH(series_of("--record", file),
                      Catch::Contains("a.rec: is being written by another program; expected a name"));
  }
  CHECK(series_of("--record", file).next == folder.path / "a.2.rec");
}

TEST_CASE("a room's file is named after it", "[record]") {
  CHECK(named_after("out/session.rec", "liver") == "out/session-liver.rec");
  CHECK(plain_name("../x") == "_._x");
  CHECK(named_after("session", "left/../lobe 2") == "session-left_.._lobe_2");
}

TEST_CASE("the files of a series are found by their numbers, and the next one is later than all", "[record]") {
  const Folder folder;
  const auto series = [&](const char* name) { return series_of("--record", folder.path / name); };
  const auto newest = [&](const char* name) { return series(name).there.front().filename().string(); };
  CHECK(series("a.rec").there.empty());
  CHECK(series("a.rec").next == folder.path / "a.rec");
  CHECK(series_of("--record", folder.path / "new" / "a.rec").there.empty());
  for (const char* name : {"a.rec", "a.2.rec", "a.10.rec", "a.x.rec", "a-liver.rec", "a.01.rec", "a.-3.rec", "ab.rec"})
    std::ofstream(folder.path / name) << "something";
  CHECK(newest("a.rec") == "a.10.rec");
  CHECK(series("a.rec").there.size() == 3);
  CHECK(series("a.rec").next == folder.path / "a.11.rec");
  std::ofstream(folder.path / "a.11.rec");  // empty after a power cut
  CHECK(newest("a.rec") == "a.10.rec");
  CHECK(series("a.rec").next == folder.path / "a.12.rec");
  std::filesystem::create_directory(folder.path / "a.20.rec");
  CHECK(series("a.rec").next == folder.path / "a.12.rec");
  CHECK(series("a-liver.rec").next == folder.path / "a-liver.2.rec");
}
