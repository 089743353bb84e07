#include "bench/output/output.hpp"

#include <fstream>
#include <utility>

#include "bench/output/run_record.hpp"
#include "common/base/error.hpp"
#include "common/io/make_folder.hpp"

namespace palpate {

std::filesystem::path make_output_folder(const std::string& folder) {
  make_folder("--out " + folder, folder);
  return folder;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw InputError(file.string(), "cannot be written", "room on the disk and the right to write");
}

void write_json(const std::filesystem::path& file, Json json) {
  if (json.is_object() || json.is_null()) json["run"] = run_record();
  write_text(file, json.dump(2) + "\n");
}

}  // namespace palpate
