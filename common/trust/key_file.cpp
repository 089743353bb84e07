#include "common/trust/key_file.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <optional>
#include <set>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"

namespace palpate {
namespace {

constexpr char kKeyExpected[] = "44 characters that palpate-key prints";
constexpr char kLinesExpected[] = "self, server, station, issuer or issuer-self";

/// One line of a key file, split into words.
class KeyLine {
 public:
  KeyLine(std::string_view line, std::string where) : where_(std::move(where)) { split(line); }

  bool empty() const { return words_.empty(); }
  bool begins_with(std::string_view word) const { return !words_.empty() && words_.front() == word; }
  bool more() const { return next_ < words_.size(); }
  [[noreturn]] void fail(const std::string& what, const std::string& expected) const { throw InputError(where_, what, expected); }

  std::string word(const char* expected) {
    if (!more()) fail("the line ends too early", expected);
    return words_[next_++];
  }
  PublicKey key() {
    const std::string text = word(kKeyExpected);
    const auto found = key_from(text);
    if (!found) fail(in_quotes(text) + " is no key", kKeyExpected);
    return *found;
  }
  /// The secret does not appear in error messages.
  template <class Secret>
  Secret secret() {
    const auto found = key_from(word(kKeyExpected));
    if (!found) fail("the secret is no key", kKeyExpected);
    Secret secret;
    secret.bytes = found->bytes;
    return secret;
  }
  void end() const {
    if (more()) fail(in_quotes(words_[next_]) + " is too much", "the end of the line");
  }

 private:
  void split(std::string_view line) {
    bool quoted = false, begun = false;
    std::string word;
    const auto finish = [&] {
      if (begun) words_.push_back(std::move(word));
      word.clear();
      begun = false;
    };
    for (const char c : line) {
      if (c == '"') {
        quoted = !quoted;
        begun = true;
      } else if (!quoted && c == '#') {
        break;
      } else if (!quoted && (c == ' ' || c == '\t' || c == '\r')) {
        finish();
      } else {
        word += c;
        begun = true;
      }
    }
    if (quoted) fail("a \" is not closed", "names as \"OR 3\"");
    finish();
  }

  std::string where_;
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

int whole(const KeyLine& line, std::string_view text, const char* what, int most) {
  int number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc{} || end != text.data() + text.size() || number < 1 || number > most)
    line.fail(std::string(what) + " is " + in_quotes(text), "a whole number from 1 to " + std::to_string(most));
  return number;
}

void read_limit(KeyLine& line, const std::string& word, Rights& rights) {
  const auto equals = word.find('=');
  const std::string name = word.substr(0, equals), value = equals == std::string::npos ? "" : word.substr(equals + 1);
  if (name == "room") {
    if (!fits_name(value) || rights.rooms.size() >= kMostRoomsNamed)
      line.fail("room is " + in_quotes(value), "up to 16 names of 1 to 64 bytes");
    rights.rooms.push_back(value);
  } else if (name == "kbit_s") {
    rights.kbit_s = whole(line, value, "kbit_s", kMostKbit);
  } else if (name == "streams") {
    rights.streams = whole(line, value, "streams", kMostStreams);
  } else {
    line.fail(in_quotes(word) + " limits nothing", "room=NAME, kbit_s=N or streams=N");
  }
}

/// Names of the stations so far, in a sorted set, because a file may have thousands.
class StationNames {
 public:
  void add(const std::string& name) { names_.insert(name); }
  /// Returns a name in conflict: one of the two stations could use the name of the other (Rights::has_name).
  std::optional<std::string> like(const std::string& name) const {
    for (std::size_t end = 0; end < name.size(); ++end)
      if (std::ranges::find(kAfterName, name[end]) != kAfterName.end())
        if (const auto found = names_.find(name.substr(0, end)); found != names_.end()) return *found;
    if (names_.contains(name)) return name;
    for (const char after : kAfterName) {
      const std::string begin = name + after;
      if (const auto next = names_.lower_bound(begin); next != names_.end() && next->starts_with(begin)) return *next;
    }
    return std::nullopt;
  }

 private:
  std::set<std::string> names_;
};

void read_station(KeyLine& line, KeyFile& keys, StationNames& names) {
  const PublicKey key = line.key();
  if (keys.stations.contains(key)) line.fail("this key is there already", "each station once");
  Rights rights;
  rights.name = line.word("the station's name, for example \"OR 3\"");
  if (!fits_name(rights.name)) line.fail("the name " + in_quotes(rights.name), kNameExpected);
  const std::string roles = line.word(kRolesExpected);
  if (!read_roles(roles, rights)) line.fail(in_quotes(roles) + " is no role", kRolesExpected);
  while (line.more()) read_limit(line, line.word(""), rights);
  if (const auto other = names.like(rights.name))
    line.fail(in_quotes(rights.name) + " and " + in_quotes(*other) + " could have the same name", kNamesApart);
  names.add(rights.name);
  keys.stations.emplace(key, rights);
}

void read_line(KeyLine& line, KeyFile& keys, StationNames& names) {
  const std::string kind = line.word("");
  const auto once = [&](const auto& there) {
    if (there) line.fail("a second " + kind, "one");
  };
  if (kind == "self") {
    once(keys.self);
    keys.self = line.secret<SecretKey>();
  } else if (kind == "issuer-self") {
    once(keys.issuer_self);
    keys.issuer_self = line.secret<IssuerSecret>();
  } else if (kind == "server") {
    once(keys.server);
    keys.server = line.key();
  } else if (kind == "station") {
    read_station(line, keys, names);
  } else if (kind == "issuer") {
    keys.issuers.push_back(line.key());
    if (!is_issuer(keys.issuers.back())) line.fail("this is no issuer's key", "the key that palpate-key new --issuer printed");
    if (keys.issuers.size() > kMostIssuers) line.fail("too many issuers", "at most " + std::to_string(kMostIssuers));
  } else {
    line.fail(in_quotes(kind) + " is unknown", kLinesExpected);
  }
  line.end();
}

/// Calls `take` with each line and its number.
template <class Take>
void each_line(std::string_view text, const Take& take) {
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    take(text.substr(0, end), number);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

bool fits_name(std::string_view text) {
  return !text.empty() && text.size() <= static_cast<std::size_t>(kMaxNameBytes) && is_plain_name(text);
}

bool read_roles(std::string_view text, Rights& rights) {
  const std::array<std::pair<std::string_view, bool*>, 4> roles{
      {{"hand", &rights.hand}, {"viewer", &rights.viewer}, {"guide", &rights.guide}, {"note", &rights.note}}};
  for (const auto& [name, role] : roles) *role = false;
  for (bool more = true; more;) {
    const std::size_t end = std::min(text.find(','), text.size());
    const auto role = std::ranges::find(roles, text.substr(0, end), [](const auto& known) { return known.first; });
    if (role == roles.end() || *role->second) return false;
    *role->second = true;
    more = end < text.size();
    text.remove_prefix(more ? end + 1 : end);
  }
  return (rights.hand || rights.viewer) && (rights.hand || !rights.guide) && (rights.viewer || !rights.note);
}

KeyFile parse_keys(const std::string& text, const std::string& file) {
  KeyFile keys;
  StationNames names;
  each_line(text, [&](std::string_view line, std::size_t number) {
    KeyLine words(line, file + ":" + std::to_string(number));
    if (!words.empty()) read_line(words, keys, names);
  });
  return keys;
}

std::optional<std::string> name_like(const KeyFile& keys, const std::string& name) {
  StationNames names;
  for (const auto& [key, rights] : keys.stations) names.add(rights.name);
  return names.like(name);
}

SiteKeys site_of(const KeyFile& keys, const std::string& file) {
  if (!keys.self) throw InputError(file, "has no key of the server", "a line self SECRET: palpate-key new makes such a file");
  if (keys.stations.empty() && keys.issuers.empty())
    throw InputError(file, "lets nobody in", "a line station PUBLIC \"NAME\" hand,viewer, or issuer PUBLIC");
  return {*keys.self, keys.stations, keys.issuers};
}

ClientKeys client_of(const KeyFile& keys, const std::string& file) {
  if (!keys.self) throw InputError(file, "has no key of this station", "a line self SECRET: palpate-key new makes such a file");
  if (!keys.server) throw InputError(file, "names no server", "palpate-key trust " + file + " SERVER_PUBLIC");
  return {*keys.self, *keys.server, {}};
}

std::string station_line(const PublicKey& key, const Rights& rights) {
  assert(fits_name(rights.name) && std::all_of(rights.rooms.begin(), rights.rooms.end(), fits_name));
  std::string line = "station " + to_text(key) + " \"" + rights.name + "\" ";
  line += rights.hand && rights.viewer ? "hand,viewer" : rights.hand ? "hand" : "viewer";
  if (rights.guide) line += ",guide";
  if (rights.note) line += ",note";
  for (const std::string& room : rights.rooms) line += " room=\"" + room + "\"";
  if (rights.kbit_s != kKbitUsual) line += " kbit_s=" + std::to_string(rights.kbit_s);
  if (rights.streams != kStreamsUsual) line += " streams=" + std::to_string(rights.streams);
  return line;
}

std::string with_server(const std::string& text, const PublicKey& server) {
  const std::string line = "server " + to_text(server) + "\n";
  std::string changed;
  bool there = false;
  each_line(text, [&](std::string_view old, std::size_t) {
    const bool replaced = KeyLine(old, "").begins_with("server");
    changed += replaced ? line : std::string(old) + "\n";
    there = there || replaced;
  });
  return there ? changed : changed + line;
}

std::vector<std::uint8_t> parse_token(std::string text, const std::string& file) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r' || text.back() == ' ')) text.pop_back();
  std::vector<std::uint8_t> bytes(kMaxTokenBytes);
  const auto size = bytes_from(text, bytes);
  if (!size || *size == 0) throw InputError(file, "is no token", "the line that palpate-key issue printed");
  bytes.resize(*size);
  return bytes;
}

}  // namespace palpate
