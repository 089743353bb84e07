// Exports a recording as CSV files: OUT/frames.csv, events.csv, tasks.csv, notes.csv and guidance.csv, and for each station
// OUT/STATION/samples.csv (a motion file), forces.csv, links.csv, patches.csv, and hand_overs.csv for a client's recording.
// docs/reference/recording.md lists the columns.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/record/reader.hpp"

namespace palpate {

/// Names the folder of each station. Station names are chosen by others, folder names by us: plain (plain_name()) and without
/// dots, so that none equals a file of an export. If two names look alike to a file system, the later one gets "-2", "-3" ...
/// appended, and so does the name "shapes".
class StationFolders {
 public:
  const std::string& of(const std::string& station);

 private:
  std::map<std::string, std::string> folders_;
  std::set<std::string> taken_{"shapes"};  // in lower case
};

struct CsvExport {
  std::size_t rows = 0, blocks_lost = 0;
  StationFolders folders;
};

/// Exports to `out`, which must exist, block by block. Throws InputError if a file cannot be written.
CsvExport export_csv(const RecordingReader& recording, const std::filesystem::path& out);

}  // namespace palpate
