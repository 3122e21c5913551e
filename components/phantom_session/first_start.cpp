#include "components/phantom_session/first_start.hpp"

#include <fstream>
#include <istream>
#include <iterator>
#include <ostream>
#include <system_error>

#include "common/core/errors.hpp"

namespace phantom::phantom_session {
namespace {

namespace fs = std::filesystem;

constexpr const char* kQuestion =
    "No topology is named (--deployment FILE). What do you want to begin with?\n"
    "  1  the demo: the shipped hot cell, with a simulated arm and operator\n"
    "  2  a cell of your own: a copy of the hot cell, to put your meshes into\n"
    "  3  an arm of your own: a bench with an example arm, to put your URDF into\n"
    "1, 2 or 3 [1]: ";

/// What is copied for a beginning: a topology, its cell's folder, and a file that the cell names beyond it.
struct Source {
  const char *topology, *cell, *beyond;
  const char* next;
};
constexpr Source kCellSource{
    "single_host.yaml", "hot_cell", "",
    "  cell.yaml      box, voxels, layers and objects: name your meshes with poses and units\n"
    "  meshes/        put them here (STL, OBJ, PLY, glTF …)\n"
    "  reaches.yaml   what the simulated operator does; remove those to objects that you remove\n"
    "  topology.yaml  which process runs where\n"
    "Every key: wva_server --help-cell.\n"};
constexpr Source kArmSource{
    "gripper.yaml", "gripper_bench", "arms/laboratory_arm.urdf",
    "  laboratory_arm.urdf  replace it by your arm's (the output of xacro)\n"
    "  cell.yaml            its name, the last link (tip_link), where it is mounted, home, skin\n"
    "  slave_io.yaml        the gripper; remove its section for an arm without one\n"
    "  reaches.yaml         what the simulated operator does, by your arm's joints\n"
    "  topology.yaml        which process runs where\n"
    "Every key: phantom_sensing --help-cell.\n"};

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw core::MissingError(file.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw core::MissingError(file.string() + ": cannot be written");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

void copy_cell(const fs::path& from, const fs::path& to) {
  constexpr auto kTrees = fs::copy_options::recursive;
  for (const auto& entry : fs::directory_iterator(from)) {
    const fs::path name = entry.path().filename();
    // Drawings and pictures of the shipped cell are no part of another.
    if (name == "cad" || name == "README.md" || name.extension() == ".png") continue;
    fs::copy(entry.path(), to / name, kTrees);
  }
}

}  // namespace

FirstAnswer ask_first_start(std::istream& in, std::ostream& out) {
  std::string line;
  for (;;) {
    out << kQuestion << std::flush;
    if (!std::getline(in, line) || line.empty() || line == "1") return {};
    if (line == "2" || line == "3") break;
  }
  const bool cell = line == "2";
  const std::string usual = cell ? "my_cell" : "my_arm";
  out << "Folder to begin in [" << usual << "]: " << std::flush;
  if (!std::getline(in, line)) return {};
  return {cell ? Beginning::kOwnCell : Beginning::kOwnArm, line.empty() ? usual : line};
}

std::string begin_own(Beginning beginning, const fs::path& folder, const fs::path& deploy) {
  const Source& source = beginning == Beginning::kOwnArm ? kArmSource : kCellSource;
  std::error_code none;
  if (fs::exists(folder, none) && !(fs::is_directory(folder, none) && fs::is_empty(folder, none)))
    throw core::ConfigError(folder.string() + ": something is there; allowed: a new folder, or an empty one");
  const fs::path topology = fs::absolute(folder) / "topology.yaml";
  try {
    fs::create_directories(folder);
    const std::string cell_folder = std::string("../cells/") + source.cell + "/";
    copy_cell(deploy / "cells" / source.cell, folder);
    if (*source.beyond != '\0') {
      const fs::path beyond = deploy / source.beyond;
      fs::copy_file(beyond, folder / beyond.filename());
      write(folder / "cell.yaml",
            replaced(text_of(folder / "cell.yaml"), std::string("../../") + source.beyond,
                     beyond.filename().string()));
    }
    std::string text = replaced(text_of(deploy / "topologies" / source.topology), cell_folder, "");
    write(topology, replaced(std::move(text), "../qos/", fs::absolute(deploy).string() + "/qos/"));
  } catch (const fs::filesystem_error& problem) {
    throw core::MissingError(problem.what());
  }
  const std::string named = " --deployment " + topology.string() + "\n";
  return "In " + folder.string() + " now stand\n" + source.next + "Check it: wva_server --check" + named +
         "Run it:   phantom_session" + named;
}

}  // namespace phantom::phantom_session
