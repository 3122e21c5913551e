#include "common/geometry/mesh/stand_in.hpp"

#include <algorithm>
#include <fstream>

#include "common/core/text.hpp"

namespace phantom::geometry {

std::string stand_in_at(const std::filesystem::path& path) {
  std::string head(256, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (head.starts_with("version https://git-lfs.github.com/") || head.starts_with("version https://hawser."))
    return "is a pointer of Git LFS, not the file itself: git lfs pull fetches it";
  if (head.starts_with("/annex/objects/"))
    return "is a pointer of git-annex, not the file itself: git annex get fetches it";
  if (head.starts_with("\x1f\x8b")) return "is compressed by gzip: unpack it";
  constexpr std::string_view kPlain[] = {".stl", ".obj",  ".ply",  ".off",  ".dae",
                                         ".glb", ".gltf", ".urdf", ".xacro"};
  const std::string ending = core::lower_case(path.extension().string());
  if (head.starts_with("PK\x03\x04") && std::ranges::find(kPlain, ending) != std::end(kPlain))
    return "is a ZIP archive: unpack it";
  std::string_view text = head;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const std::string begin = core::lower_case(core::trimmed(text));
  if (begin.starts_with("<!doctype html") || begin.starts_with("<html"))
    return "is a web page (HTML), not the file itself: a page with an error or a login was saved in its place";
  return {};
}

}  // namespace phantom::geometry
