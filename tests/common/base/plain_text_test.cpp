#include "common/base/plain_text.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace palpate;

TEST_CASE("Text is UTF-8 in its shortest form, without control characters and others that cannot be seen") {
  for (const char* good : {"", "OR 3", "Çavuşoğlu", "手", "\xf0\x9f\x96\x90", "\xed\x9f\xbf", "\xee\x80\x80", "\xf4\x8f\xbf\xbf"})
    CHECK(is_plain_text(good));
  for (const char* bad : {"\xff",
                          "hand\xff",
                          "\x80",
                          "\xc3",
                          "\xc0\xaf",
                          "\xe0\x80\xaf",
                          "\xed\xa0\x80",
                          "\xf4\x90\x80\x80",
                          "\xf0\x80\x80\xaf",
                          "\xe6\x89",
                          "a\nb",
                          "\x7f",
                          "\xc2\x85",
                          "left\u202eright",
                          "or\u200b3",
                          "a\u2028b",
                          "a\u2029b",
                          "\ufeff",
                          "\u00ad",
                          "\U000e0041",
                          "\xf8\x88\x80\x80\x80"}) {
    CAPTURE(std::string(bad));
    CHECK_FALSE(is_plain_text(bad));
  }
}

TEST_CASE("A name is a text without the quotes that it is put into") {
  CHECK(is_plain_name("OR 3, Müller's hand"));
  CHECK_FALSE(is_plain_name("a\" joined; station \"b"));
  CHECK_FALSE(is_plain_name("or\u202e3"));
}

TEST_CASE("A text is cut between characters") {
  const std::string text = "a手b";  // 1, 3 and 1 bytes
  CHECK(cut_text(text, 5) == text);
  CHECK(cut_text(text, 4) == "a手");
  CHECK(cut_text(text, 3) == "a");
  CHECK(cut_text(text, 0).empty());
  CHECK(cut_text("ab\xff", 9) == "ab");
}
