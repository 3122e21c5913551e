#pragma once

#include <filesystem>
#include <string>

namespace phantom::geometry {

/// Returns what stands at `path` in place of a file that was wanted, and what to do, as the end of a sentence
/// ("is a pointer of Git LFS …"): a repository's pointer, a web page, a compressed file. Empty if it is none
/// of these, or cannot be read. Reads the file's first bytes only.
std::string stand_in_at(const std::filesystem::path& path);

}  // namespace phantom::geometry
