#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace phantom::bench {

/// The documents of DDS Security for a site of a benchmark's own, made for this run by deploy/security/make.
class SecuritySite {
 public:
  /// `rights`: lines as idl/contract.py --rights prints. `rtps_signed`: each message is signed as a whole,
  /// too.
  SecuritySite(const std::string& rights, int domain, bool rtps_signed = false) {
    const std::filesystem::path tools = folder_ / "tools";
    std::filesystem::copy(PHANTOM_SOURCE_DIR "/deploy/security", tools,
                          std::filesystem::copy_options::recursive);
    std::ofstream(tools / "rights") << rights;
    std::string command = "cd '" + tools.string() + "' && ";
    if (rtps_signed)
      command += "sed -i 's/<rtps_protection_kind>NONE/<rtps_protection_kind>SIGN/' governance.xml && ";
    command +=
        "./make site '" + documents().string() + "' --domain " + std::to_string(domain) + " >/dev/null";
    made_ = std::system(command.c_str()) == 0;  // NOLINT(concurrency-mt-unsafe)
  }
  SecuritySite(const SecuritySite&) = delete;
  SecuritySite& operator=(const SecuritySite&) = delete;
  ~SecuritySite() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  /// Whether the documents are there.
  bool made() const { return made_; }
  std::filesystem::path documents() const { return folder_ / "site"; }

 private:
  const std::filesystem::path folder_ = [] {
    std::string name = (std::filesystem::temp_directory_path() / "phantom_bench_XXXXXX").string();
    return std::filesystem::path(mkdtemp(name.data()));
  }();
  bool made_ = false;
};

}  // namespace phantom::bench
