// A token: permission for one station to join one server, signed by an issuer (Ed25519, RFC 8032), verified offline.
//
//     id 16, issuer 4, join before 8 [unix s], session 4 [s], roles 1 (1 hand, 2 viewer, 4 guide, 8 note), kbit/s 2, streams 1,
//     length 1 and name, length 1 and room (empty: any), signature 64                    little end first, at most 256 bytes
//
// The signature covers "palpate token 1", the server's key, the station's key and everything before it: a token that is stolen,
// or presented to another server, is useless. `issuer`: the first bytes of the issuer's key, to select the one to check with. A
// server accepts `streams` sessions with one token (one by default: single use), before `join before`; each ends `session` after
// it began.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/trust/channel_wire.hpp"
#include "common/trust/rights.hpp"

namespace palpate {

using TokenId = std::array<std::uint8_t, 16>;

struct Token {
  TokenId id{};
  std::int64_t join_before_s = 0;  ///< unix time
  std::uint32_t session_s = 0;
  Rights rights;     ///< at most one room
  PublicKey issuer;  ///< set by verify_token()
};

/// Returns an empty list when the contents do not fit: name or room longer than kMaxNameBytes, several rooms.
std::vector<std::uint8_t> sign_token(const Token& token, const IssuerSecret& issuer, const PublicKey& server,
                                     const PublicKey& station);

/// Returns nothing when none of the issuers signed this for these two keys, or for invalid contents.
std::optional<Token> verify_token(Bytes bytes, std::span<const PublicKey> issuers, const PublicKey& server,
                                  const PublicKey& station);

}  // namespace palpate
