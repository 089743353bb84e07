// The text of a key file of a server, a station or an issuer. One entry a line; # begins a comment; values with spaces are in "".
//
//     self SECRET                            the owner of the file (X25519)
//     server PUBLIC                          in a station's: the only server that it accepts
//     station PUBLIC "OR 3" hand,viewer,guide,note room=liver room="left lung" kbit_s=900 streams=8
//     issuer PUBLIC                          in a server's: accepted signer of tokens (Ed25519)
//     issuer-self SECRET                     in an issuer's: its own secret
//
// A station without room= may join any room. A server's keys change only as a whole (SIGHUP): parsing throws for the first error,
// as FILE:LINE: what; expected what.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/trust/client_channel.hpp"
#include "common/trust/rights.hpp"

namespace palpate {

/// The keys that a server accepts.
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

/// Throws InputError, which names `file`.
KeyFile parse_keys(const std::string& text, const std::string& file);
/// Returns the name of a station of the file that could have the same name as a station of this one (Rights::has_name), if any.
std::optional<std::string> name_like(const KeyFile& keys, const std::string& name);
inline constexpr char kNamesApart[] = "names of which none is another one, or another one with - or / behind it";
/// Throws InputError without `self`, or when there is nobody to admit.
SiteKeys site_of(const KeyFile& keys, const std::string& file);
/// Throws InputError without `self` or `server`. `token`: the text of its file.
ClientKeys client_of(const KeyFile& keys, const std::string& file);

/// True for a name of a station or room that a key file can hold between double quotes, without affecting the rest of the line.
bool fits_name(std::string_view text);
inline constexpr char kNameExpected[] = "1 to 64 bytes of UTF-8 without control characters, others that cannot be seen, or \"";

/// Returns the line of a station. Names and rooms satisfy fits_name().
std::string station_line(const PublicKey& key, const Rights& rights);
/// Returns the text with this server as the only one, and everything else unchanged.
std::string with_server(const std::string& text, const PublicKey& server);
/// Parses for example "hand,viewer"; returns false for another text, for a guide without a hand, and for note without
/// a viewer.
inline constexpr char kRolesExpected[] =
    "hand, viewer, or hand,viewer; with ,guide behind hand for one that may guide others, and ,note behind viewer for one that "
    "may "
    "write notes into recordings";
bool read_roles(std::string_view text, Rights& rights);
/// Throws InputError.
std::vector<std::uint8_t> parse_token(std::string text, const std::string& file);

}  // namespace palpate
