// A recording as CSV files: OUT/frames.csv, OUT/events.csv, and for each station OUT/STATION/samples.csv (a motion file),
// forces.csv, links.csv, patches.csv, and hand_overs.csv of a client's recording. docs/reference/recording.md has the columns.
#pragma once

#include <filesystem>

#include "common/record/reader.hpp"

namespace palpate {

struct CsvExport {
  std::size_t rows = 0, blocks_lost = 0;
};

/// `out` is there. InputError when a file cannot be written. Goes through the recording block by block.
CsvExport export_csv(const RecordingReader& recording, const std::filesystem::path& out);

/// The folder of a station in `out`.
std::filesystem::path station_folder(const std::filesystem::path& out, const std::string& station);

}  // namespace palpate
