// Damages mesh files at random for a while and reads them: load_mesh() must return, in bounded time, a mesh
// or a reason.
//   damage_mesh_files SECONDS FOLDER_OF_MESHES [SEED]
// Ends with 1 and keeps the file if a rule is broken.

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/geometry/mesh/mesh_io.hpp"

namespace {

using namespace phantom;
namespace fs = std::filesystem;

struct Seed {
  fs::path path;
  std::string bytes;
};

bool may_hold_a_mesh(const fs::path& path) {
  static const std::set<std::string> others = {".bin", ".bmp", ".frag", ".glsl", ".jpg", ".md",
                                               ".mtl", ".png", ".tga",  ".txt",  ".vert"};
  return !others.contains(path.extension().string());
}

std::vector<Seed> seeds_in(const fs::path& folder) {
  std::vector<Seed> seeds;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || !may_hold_a_mesh(entry.path())) continue;
    if (entry.file_size() == 0 || entry.file_size() > 200'000) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    seeds.push_back({entry.path(), std::string(std::istreambuf_iterator<char>(file), {})});
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.path < b.path; });
  return seeds;
}

std::string damaged(std::string bytes, std::mt19937& random) {
  const auto at = [&] { return random() % bytes.size(); };
  for (int hits = 1 + static_cast<int>(random() % 8); hits > 0; --hits) {
    switch (random() % 5) {
      case 0:
        bytes[at()] = static_cast<char>(random());
        break;
      case 1:
        bytes[at()] ^= static_cast<char>(1 << (random() % 8));
        break;
      case 2:
        bytes.resize(1 + at());
        break;
      case 3:
        bytes.insert(at(), bytes.substr(at(), random() % 64));
        break;
      default: {  // a count or an offset: a great number of four bytes
        const std::size_t from = at();
        for (std::size_t i = from; i < std::min(from + 4, bytes.size()); ++i)
          bytes[i] = static_cast<char>(0x7f);
      }
    }
  }
  return bytes;
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "damage_mesh_files SECONDS FOLDER_OF_MESHES [SEED]\n");
    return 2;
  }
  const double seconds = std::atof(words[1]);
  const auto seeds = seeds_in(words[2]);
  const auto seed = count > 3 ? static_cast<unsigned>(std::atoi(words[3])) : std::random_device{}();
  if (seeds.empty()) {
    std::fprintf(stderr, "damage_mesh_files: no files in %s\n", words[2]);
    return 2;
  }
  std::mt19937 random(seed);
  const fs::path folder = fs::temp_directory_path() / ("damaged_meshes_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const geometry::MeshImportOptions limits{.max_cpu_s = 2, .max_memory_bytes = 512 << 20};
  const auto start_ns = core::monotonic_ns();
  int meshes = 0, reasons = 0;
  while (core::monotonic_ns() - start_ns < core::from_seconds(seconds)) {
    const Seed& from = seeds[random() % seeds.size()];
    const fs::path path = folder / ("damaged" + from.path.extension().string());
    std::ofstream(path, std::ios::binary) << damaged(from.bytes, random);
    const auto before_ns = core::monotonic_ns();
    const auto mesh = geometry::load_mesh(path, limits);
    const bool in_time = core::monotonic_ns() - before_ns < core::from_seconds(20);
    const bool fine = mesh ? mesh->all_finite() && !mesh->triangles.empty()
                           : mesh.status().message().find(path.string()) != std::string::npos;
    if (!fine || !in_time) {
      std::fprintf(stderr, "damage_mesh_files: %s, made of %s with seed %u: %s\n", path.c_str(),
                   from.path.c_str(), seed,
                   in_time ? "neither a mesh nor a reason that names the file" : "took too long");
      return 1;
    }
    ++(mesh ? meshes : reasons);
  }
  fs::remove_all(folder);
  std::printf("damage_mesh_files: seed %u: %d meshes, %d reasons\n", seed, meshes, reasons);
  return 0;
}
