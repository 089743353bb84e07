#include "common/session/seq_tracker.hpp"

#include <catch2/catch.hpp>

using palpate::SeqTracker;

TEST_CASE("datagrams in order are received and nothing else") {
  SeqTracker seq;
  for (std::uint32_t i = 5; i < 105; ++i) CHECK(seq.take(i));
  CHECK(seq.counts().received == 100);
  CHECK(seq.counts().lost == 0);
  CHECK(seq.counts().late == 0);
}

TEST_CASE("a gap is lost until the missing one comes late") {
  SeqTracker seq;
  seq.take(1);
  seq.take(4);
  CHECK(seq.counts().lost == 2);
  CHECK_FALSE(seq.take(3));
  CHECK(seq.counts().lost == 1);
  CHECK(seq.counts().late == 1);
  CHECK(seq.take(5));
}

TEST_CASE("a duplicate is counted once as such and never as received") {
  SeqTracker seq;
  for (std::uint32_t i = 0; i < 10; ++i) seq.take(i);
  CHECK_FALSE(seq.take(9));
  CHECK_FALSE(seq.take(2));
  CHECK(seq.counts().received == 10);
  CHECK(seq.counts().duplicates == 2);
  CHECK(seq.counts().lost == 0);
}

TEST_CASE("numbers that wrap around are younger") {
  SeqTracker seq;
  CHECK(seq.take(0xfffffffeu));
  CHECK(seq.take(0xffffffffu));
  CHECK(seq.take(1));
  CHECK(seq.counts().lost == 1);
  CHECK_FALSE(seq.take(0));
  CHECK(seq.counts().lost == 0);
}

TEST_CASE("a leap of more than the window forgets duplicates, not the loss") {
  SeqTracker seq;
  seq.take(0);
  seq.take(1000);
  CHECK(seq.counts().lost == 999);
}
