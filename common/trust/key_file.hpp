// The text of a key file, of a server, a station or an issuer. One thing a line; # begins a comment; what has spaces is in "".
//
//     self SECRET                            whose file this is (X25519)
//     server PUBLIC                          a station's: the one server that it believes
//     station PUBLIC "OR 3" hand,viewer room=liver room="left lung" kbit_s=900 streams=8
//     issuer PUBLIC                          a server's: who signs tokens (Ed25519)
//     issuer-self SECRET                     an issuer's own
//
// A station without room= may be in any room. A server's keys change only as a whole (SIGHUP): who reads such a file throws for
// the first thing that is wrong, as FILE:LINE: what; expected what.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/trust/client_channel.hpp"
#include "common/trust/rights.hpp"

namespace palpate {

/// What a server believes.
struct SiteKeys {
  SecretKey self;
  std::map<PublicKey, Rights> stations;
  std::vector<PublicKey> issuers;
};

struct KeyFile {
  std::optional<SecretKey> self;
  std::optional<IssuerSecret> issuer_self;
  std::optional<PublicKey> server;
  std::map<PublicKey, Rights> stations;
  std::vector<PublicKey> issuers;
};

inline constexpr std::size_t kMostIssuers = 16;

/// InputError, which names `file`.
KeyFile parse_keys(const std::string& text, const std::string& file);
/// InputError where there is no `self`, or nobody to let in.
SiteKeys site_of(const KeyFile& keys, const std::string& file);
/// InputError where there is no `self` or no `server`. `token`: as it stands in its file.
ClientKeys client_of(const KeyFile& keys, const std::string& file);

/// Of a station or room: what a key file can say between double quotes, so that nothing else of a line is in it.
bool fits_name(std::string_view text);
inline constexpr char kNameExpected[] = "1 to 64 bytes of UTF-8 without control characters, others that cannot be seen, or \"";

/// Names and rooms fit (fits_name()).
std::string station_line(const PublicKey& key, const Rights& rights);
/// The text with this one server in it, everything else as it was.
std::string with_server(const std::string& text, const PublicKey& server);
/// "hand,viewer"; false for another text.
bool read_roles(std::string_view text, Rights& rights);
/// InputError.
std::vector<std::uint8_t> parse_token(std::string text, const std::string& file);

}  // namespace palpate
