// A recording as CSV files: OUT/frames.csv, OUT/events.csv, and for each station OUT/STATION/samples.csv (a motion file),
// forces.csv, links.csv, patches.csv, and hand_overs.csv of a client's recording. docs/reference/recording.md has the columns.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/record/reader.hpp"

namespace palpate {

/// Each station's own folder. Names are of others, folders ours: plain (plain_name()), without dots, so that none is called as a
/// file of an export is; of two names that look alike to a file system the later one, and one that is called "shapes", has "-2",
/// "-3" ... behind it.
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

/// `out` is there. InputError when a file cannot be written. Goes through the recording block by block.
CsvExport export_csv(const RecordingReader& recording, const std::filesystem::path& out);

}  // namespace palpate
