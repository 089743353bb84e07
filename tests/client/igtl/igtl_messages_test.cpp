// The bytes of OpenIGTLink against published values and against damage; igtl_library_test.cpp compares them with its own library.
#include "client/igtl/igtl_messages.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "tests/client/igtl/ball.hpp"

using namespace palpate;

namespace {

std::optional<IgtlMessage> read_one(const std::string& bytes) {
  IgtlReader reader;
  reader.add(bytes);
  return reader.next();
}

std::string big_endian(std::uint64_t number, int bytes) {
  std::string out;
  for (int shift = 8 * bytes - 8; shift >= 0; shift -= 8) out += static_cast<char>(number >> shift & 0xff);
  return out;
}

/// Returns the message with another body, and the header that fits it.
std::string with_body(const std::string& message, const std::string& body, int version = 1) {
  return big_endian(static_cast<std::uint64_t>(version), 2) + message.substr(2, 40) + big_endian(body.size(), 8) +
         big_endian(igtl_crc(body), 8) + body;
}

}  // namespace

TEST_CASE("The check sum has the check value of CRC-64/ECMA-182", "[igtl]") {
  CHECK(igtl_crc("123456789") == 0x6c40df5f0b497347);
  CHECK(igtl_crc("") == 0);
}

TEST_CASE("A TRANSFORM has the header, the columns of the rotation and the place, big-endian", "[igtl]") {
  Mat3 rotation;
  rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const std::string bytes = igtl_transform("a name of more than 20 bytes", rotation, Vec3(1.5, -2, 0.25), 0x0000000100000000);
  REQUIRE(bytes.size() == 58 + 48);
  CHECK(bytes.substr(0, 14) == std::string("\0\1TRANSFORM\0\0\0", 14));
  CHECK(bytes.substr(14, 20) == "a name of more than ");
  CHECK(bytes.substr(34, 8) == std::string("\0\0\0\1\0\0\0\0", 8));
  CHECK(bytes.substr(42, 8) == big_endian(48, 8));
  const double expected[] = {0, 1, 0, -1, 0, 0, 0, 0, 1, 1.5, -2, 0.25};
  for (std::size_t k = 0; k < 12; ++k)
    CHECK(bytes.substr(58 + 4 * k, 4) == big_endian(std::bit_cast<std::uint32_t>(static_cast<float>(expected[k])), 4));
}

TEST_CASE("A surface comes back as it was sent, also from a stream in pieces and after other messages", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f(1, 2, 3), 40);
  const std::vector<float> scalars(points.size(), 0.5F);
  const std::string stream = igtl_transform("tool", Mat3::Identity(), Vec3::Zero(), 1) + igtl_force("force", Vec3(1, 2, 3), 1) +
                             igtl_polydata("ball", points, triangles, "scalars", scalars, 1);
  IgtlReader reader;
  std::vector<IgtlMessage> messages;
  for (std::size_t at = 0; at < stream.size(); at += 97) {
    reader.add(std::string_view(stream).substr(at, 97));
    while (auto message = reader.next()) messages.push_back(std::move(*message));
  }
  REQUIRE(messages.size() == 3);
  CHECK(messages[0].type == "TRANSFORM");
  CHECK(messages[1].type == "SENSOR");
  CHECK(messages[2].name == "ball");
  const IgtlSurface surface = read_igtl_surface(messages[2].content);
  CHECK(surface.points_mm.size() == points.size());
  REQUIRE(surface.triangles.size() == triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) CHECK(surface.points_mm[surface.triangles[k][c]] == points[triangles[k][c]]);
}

TEST_CASE("Points at one place become one, as in a surface whose triangles share no points", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  std::vector<Vec3f> apart;
  std::vector<Triangle> own;
  for (const Triangle& t : triangles) {
    const auto first = static_cast<std::uint32_t>(apart.size());
    for (const std::uint32_t corner : t) apart.push_back(points[corner]);
    own.push_back({first, first + 1, first + 2});
  }
  const auto message = read_one(igtl_polydata("b", apart, own, "s", std::vector<float>(apart.size()), 1));
  REQUIRE(message);
  CHECK(read_igtl_surface(message->content).points_mm.size() == points.size());
}

TEST_CASE("The extended header and the metadata of version 3 are left out", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  const std::string plain = igtl_polydata("b", points, triangles, "s", std::vector<float>(points.size()), 1),
                    body = plain.substr(58);
  const std::string metadata = "some metadata";
  const std::string extended = big_endian(12, 2) + big_endian(2, 2) + big_endian(metadata.size(), 4) + big_endian(7, 4);
  const auto message = read_one(with_body(plain, extended + body + big_endian(0, 2) + metadata, 3));
  REQUIRE(message);
  CHECK(message->content == body);
}

TEST_CASE("What is no OpenIGTLink, too large or damaged is refused with what is wrong", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  const std::string good = igtl_polydata("b", points, triangles, "s", std::vector<float>(points.size()), 1);
  CHECK_THROWS_WITH(read_one("GET / HTTP/1.1\r\n" + std::string(60, ' ')), Catch::Contains("a header of version"));
  std::string wrong = good;
  wrong[100] ^= 1;
  CHECK_THROWS_WITH(read_one(wrong), Catch::Contains("wrong check sum"));
  std::string large = good;
  large.replace(42, 8, big_endian(IgtlReader::kBodyBytesMost + 1, 8));
  CHECK_THROWS_WITH(read_one(large), Catch::Contains("64 MB at most"));
  CHECK_FALSE(read_one(good.substr(0, good.size() - 1)));
  CHECK_THROWS_WITH(read_one(with_body(good, big_endian(9999, 2) + good.substr(60), 3)), Catch::Contains("extended header"));
}

TEST_CASE("Every cut and every changed byte of a surface is a surface, or is refused", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  const std::string content = igtl_polydata("b", points, triangles, "s", std::vector<float>(points.size()), 1).substr(58);
  const auto tried = [](const std::string& bytes) {
    try {
      return is_closed(read_igtl_surface(bytes).triangles);
    } catch (const InputError&) {
      return true;
    }
  };
  for (std::size_t size = 0; size < content.size(); size += 3) REQUIRE(tried(content.substr(0, size)));
  for (std::size_t at = 0; at < content.size(); ++at)
    for (const int bit : {0, 7}) {
      std::string changed = content;
      changed[at] = static_cast<char>(changed[at] ^ 1 << bit);
      REQUIRE(tried(changed));
    }
}

TEST_CASE("A surface that no body can have is refused with the reason", "[igtl]") {
  auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  const auto refusal = [](const std::vector<Vec3f>& p, const std::vector<Triangle>& t) -> std::string {
    try {
      read_igtl_surface(igtl_polydata("b", p, t, "s", std::vector<float>(p.size()), 1).substr(58));
    } catch (const InputError& fault) {
      return fault.what();
    }
    return "";
  };
  CHECK(refusal(points, triangles).empty());
  CHECK(refusal(points, {}).find("without triangles") != std::string::npos);
  auto open = triangles;
  open.pop_back();
  CHECK(refusal(points, open).find("holes") != std::string::npos);
  auto astray = triangles;
  astray[3][1] = static_cast<std::uint32_t>(points.size());
  CHECK(refusal(points, astray).find("a point that is not there") != std::string::npos);
  points[2].y() = std::nanf("");
  CHECK(refusal(points, triangles).find("not a number") != std::string::npos);
}
