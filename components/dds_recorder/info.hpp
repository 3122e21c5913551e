#pragma once

#include <iosfwd>
#include <map>
#include <nlohmann/json_fwd.hpp>

#include "components/dds_recorder/files.hpp"
#include "components/dds_recorder/losses.hpp"

namespace phantom::dds_recorder {

/// The figures of one topic in a file, for `dds_recorder info`.
struct TopicFigures {
  std::string type;
  std::uint64_t samples = 0, carried_over = 0, writers = 0;
  double rate_hz = 0.0;  ///< samples ÷ the file's length
  TopicLosses losses;
};

struct FileFigures {
  std::string path;
  std::uint64_t bytes = 0;
  bool complete = false;
  std::vector<std::string> problems;
  std::uint64_t start_ns = 0, end_ns = 0, samples = 0, chunks = 0;
  recording::StringMap about;                  ///< kAboutRecord
  std::vector<recording::StringMap> triggers;  ///< kTriggerRecord
  std::string ended;                           ///< kEndRecord's reason; empty: the file did not end in order
  std::vector<std::string> attachments;
  std::map<std::string, TopicFigures> topics;
  double seconds() const { return 1e-9 * static_cast<double>(end_ns - start_ns); }
};

FileFigures figures_of(const OpenedRecording& opened);
nlohmann::ordered_json json_of(const FileFigures& figures);
void print(const FileFigures& figures, std::ostream& out);

/// Carries out `dds_recorder info FILE…`: prints a table per file, or with `json` one JSON array. Returns the
/// exit code.
int run_info(const std::vector<std::filesystem::path>& files, bool json, std::ostream& out);
/// Carries out `dds_recorder check FILE…`: reads every byte and prints a line per file and problem. Returns
/// exit code 1 if there is a problem.
int run_check(const std::vector<std::filesystem::path>& files, bool json, std::ostream& out);

}  // namespace phantom::dds_recorder
