// A token: leave for one station to join one server, signed by an issuer (Ed25519, RFC 8032), checked without asking anybody.
//
//     id 16, issuer 4, join before 8 [unix s], session 4 [s], roles 1 (1 hand, 2 viewer), kbit/s 2, streams 1,
//     length 1 and name, length 1 and room (empty: any), signature 64                    little end first, at most 256 bytes
//
// The signature is of "palpate token 1", the server's key, the station's key and all before it: a token that is stolen, or shown
// to another server, is of no use. `issuer`: the first bytes of the issuer's key, to know which to check with. A server lets
// `streams` sessions be opened with one token (one by default: single use), before `join before`; each ends `session` after it
// began.
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
  PublicKey issuer;  ///< as verify_token() found
};

/// Empty when it says more than fits: name or room longer than kMaxNameBytes, several rooms.
std::vector<std::uint8_t> sign_token(const Token& token, const IssuerSecret& issuer, const PublicKey& server,
                                     const PublicKey& station);

/// Nothing when none of the issuers signed this for these two, or it says what none should.
std::optional<Token> verify_token(Bytes bytes, std::span<const PublicKey> issuers, const PublicKey& server,
                                  const PublicKey& station);

}  // namespace palpate
