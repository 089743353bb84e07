#include "common/trust/token.hpp"

#include <sodium.h>

#include <algorithm>
#include <string_view>

#include "common/base/plain_text.hpp"

namespace palpate {
namespace {

constexpr std::size_t kSignatureBytes = crypto_sign_BYTES, kIssuerBytes = 4, kFixedBytes = 36;
constexpr std::uint8_t kHandRole = 1, kViewerRole = 2, kGuideRole = 4, kNoteRole = 8;
static_assert(kFixedBytes + 2 * (1 + std::size_t{kMaxNameBytes}) + kSignatureBytes <= kMaxTokenBytes);

void append(std::vector<std::uint8_t>& bytes, std::uint64_t number, std::size_t size) {
  bytes.resize(bytes.size() + size);
  put_number(BytesOut(bytes).last(size), number);
}

void append(std::vector<std::uint8_t>& bytes, std::string_view text) {
  bytes.push_back(static_cast<std::uint8_t>(text.size()));
  bytes.insert(bytes.end(), text.begin(), text.end());
}

std::vector<std::uint8_t> signed_text(Bytes body, const PublicKey& server, const PublicKey& station) {
  constexpr std::string_view kLabel = "palpate token 1";
  std::vector<std::uint8_t> text(kLabel.begin(), kLabel.end());
  text.insert(text.end(), server.bytes.begin(), server.bytes.end());
  text.insert(text.end(), station.bytes.begin(), station.bytes.end());
  text.insert(text.end(), body.begin(), body.end());
  return text;
}

/// Reads appended fields; `ok` becomes false when the data are too short.
struct TokenReader {
  Bytes rest;
  bool ok = true;

  std::uint64_t number(std::size_t size) { return number_at(bytes(size)); }
  std::string text() {
    const auto from = bytes(static_cast<std::size_t>(number(1)));
    return {from.begin(), from.end()};
  }
  Bytes bytes(std::size_t size) {
    ok = ok && size <= rest.size();
    if (!ok) return {};
    const Bytes taken = rest.first(size);
    rest = rest.subspan(size);
    return taken;
  }
};

bool fits_name(std::string_view text) { return text.size() <= static_cast<std::size_t>(kMaxNameBytes) && is_plain_name(text); }

std::optional<Token> read_body(Bytes body) {
  TokenReader reader{body};
  Token token;
  std::ranges::copy(reader.bytes(token.id.size()), token.id.begin());
  reader.bytes(kIssuerBytes);
  token.join_before_s = static_cast<std::int64_t>(reader.number(8));
  token.session_s = static_cast<std::uint32_t>(reader.number(4));
  const auto roles = static_cast<unsigned>(reader.number(1));
  token.rights.hand = (roles & kHandRole) != 0;
  token.rights.viewer = (roles & kViewerRole) != 0;
  token.rights.guide = (roles & kGuideRole) != 0;
  token.rights.note = (roles & kNoteRole) != 0;
  token.rights.kbit_s = static_cast<int>(reader.number(2));
  token.rights.streams = static_cast<int>(reader.number(1));
  token.rights.name = reader.text();
  if (std::string room = reader.text(); !room.empty()) token.rights.rooms = {room};
  const bool sound = reader.ok && reader.rest.empty() && roles != 0 &&
                     roles <= (kHandRole | kViewerRole | kGuideRole | kNoteRole) && !token.rights.name.empty() &&
                     fits_name(token.rights.name) && token.rights.streams >= 1 && token.rights.streams <= kMostStreams &&
                     (token.rights.rooms.empty() || fits_name(token.rights.rooms.front()));
  return sound ? std::optional(token) : std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> sign_token(const Token& token, const IssuerSecret& issuer, const PublicKey& server,
                                     const PublicKey& station) {
  const Rights& rights = token.rights;
  const std::string room = rights.rooms.empty() ? "" : rights.rooms.front();
  constexpr auto kMost = static_cast<std::size_t>(kMaxNameBytes);
  if (rights.name.size() > kMost || room.size() > kMost || rights.rooms.size() > 1) return {};
  const PublicKey issuer_key = issuer_of(issuer);
  std::vector<std::uint8_t> bytes(token.id.begin(), token.id.end());
  bytes.insert(bytes.end(), issuer_key.bytes.begin(), issuer_key.bytes.begin() + kIssuerBytes);
  append(bytes, static_cast<std::uint64_t>(token.join_before_s), 8);
  append(bytes, token.session_s, 4);
  append(bytes,
         (rights.hand ? kHandRole : 0u) | (rights.viewer ? kViewerRole : 0u) | (rights.guide ? kGuideRole : 0u) |
             (rights.note ? kNoteRole : 0u),
         1);
  append(bytes, static_cast<std::uint64_t>(rights.kbit_s), 2);
  append(bytes, static_cast<std::uint64_t>(rights.streams), 1);
  append(bytes, rights.name);
  append(bytes, room);
  const auto text = signed_text(bytes, server, station);
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> whole;
  PublicKey unused;
  crypto_sign_seed_keypair(unused.bytes.data(), whole.data(), issuer.bytes.data());
  bytes.resize(bytes.size() + kSignatureBytes);
  crypto_sign_detached(bytes.data() + bytes.size() - kSignatureBytes, nullptr, text.data(), text.size(), whole.data());
  wipe(whole);
  return bytes;
}

std::optional<Token> verify_token(Bytes bytes, std::span<const PublicKey> issuers, const PublicKey& server,
                                  const PublicKey& station) {
  if (bytes.size() < kFixedBytes + kSignatureBytes || bytes.size() > kMaxTokenBytes) return std::nullopt;
  const Bytes body = bytes.first(bytes.size() - kSignatureBytes), name = body.subspan(sizeof(TokenId), kIssuerBytes);
  const auto text = signed_text(body, server, station);
  for (const PublicKey& issuer : issuers) {
    if (!std::equal(name.begin(), name.end(), issuer.bytes.begin())) continue;
    if (crypto_sign_verify_detached(bytes.data() + body.size(), text.data(), text.size(), issuer.bytes.data()) != 0) continue;
    std::optional<Token> token = read_body(body);
    if (token) token->issuer = issuer;
    return token;
  }
  return std::nullopt;
}

}  // namespace palpate
