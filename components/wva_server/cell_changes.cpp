#include "components/wva_server/cell_changes.hpp"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <Eigen/LU>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/core/file_sync.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::wva_server {
namespace {

using core::ConfigError;

/// Returns the FNV-1a 64 hash of the cell file's bytes.
std::string file_hash(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (std::istreambuf_iterator<char> byte(stream), end; byte != end; ++byte)
    hash = (hash ^ static_cast<unsigned char>(*byte)) * 0x100000001b3ULL;
  return fmt::format("{:016x}", hash);
}

auto find_object(runtime::CellConfig& cell, std::uint16_t id) {
  return std::find_if(cell.objects.begin(), cell.objects.end(),
                      [id](const auto& object) { return object.id == id; });
}

ConfigError mismatch(const ObjectChange& change, const runtime::CellConfig& cell) {
  return ConfigError(fmt::format("the kept changes name '{}' (object {}), which cell {} does not have",
                                 change.name, change.id, cell.name));
}

/// Writes the rotation matrix row by row, exact to the last bit, so that the same workspace results from it.
nlohmann::json pose_json(const geometry::Pose& X) {
  nlohmann::json rotation = nlohmann::json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation.push_back(X.rotation(row, column));
  return {{"xyz_m", {X.translation_m.x(), X.translation_m.y(), X.translation_m.z()}}, {"rotation", rotation}};
}

/// Table of the keys of a file of kept changes.
constexpr const char* kChangeKeys = R"(
cell: bench            # [required]
cell_file: 0123        # [required] file_hash() of the cell's file
next_id: 1             # [required: 1 to 65535]
objects:
  - id: 1              # [required: 1 to 65534]
    name: drum         # [required]
    added: ""          # description of the object
    removed: false
    moved:
      xyz_m: []        # [required]
      rotation: []     # [required: -1.000001 to 1.000001] row by row
    guard_vox: 0       # [0 to 100 voxels]
    carried:           # by an arm; left out: it stands in the workspace
      arm: arm         # [required]
      frame: tool      # [required]
      xyz_m: []        # [required] in the frame of that link
      rotation: []     # [required: -1.000001 to 1.000001] row by row
)";

geometry::Pose read_pose(const runtime::Fields& fields) {
  geometry::Pose X;
  fields.vector3("xyz_m", X.translation_m);
  std::vector<double> rotation;
  fields.numbers("rotation", rotation);
  fields.check(rotation.size() == 9, "rotation", "needs nine numbers, a rotation matrix row by row");
  X.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  fields.check((X.rotation * X.rotation.transpose()).isIdentity(1e-9) && X.rotation.determinant() > 0,
               "rotation", "is no rotation matrix");
  return X;
}

ObjectChange read_change(const runtime::Fields& fields) {
  ObjectChange change{.name = fields.text("name"), .description = fields.text("added")};
  fields.number("id", change.id);
  fields.flag("removed", change.removed);
  if (fields.has("moved")) change.X_WO = read_pose(fields.section("moved"));
  if (fields.has("guard_vox")) fields.number("guard_vox", change.guard_vox.emplace());
  if (fields.has("carried")) {
    const runtime::Fields carried = fields.section("carried");
    change.carrier = Carrier{carried.text("arm"), carried.text("frame"), read_pose(carried)};
  }
  return change;
}

void replace_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path fresh = file.string() + ".new";
  const int fd = open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  bool ok = fd >= 0;
  for (std::size_t at = 0; ok && at < text.size();) {
    const ssize_t count = write(fd, text.data() + at, text.size() - at);
    ok = count > 0;
    if (ok) at += static_cast<std::size_t>(count);
  }
  ok = ok && fsync(fd) == 0;
  const int problem = errno;
  if (fd >= 0) close(fd);
  if (ok && std::rename(fresh.c_str(), file.c_str()) == 0 && core::sync_folder_of(file)) return;
  const std::string reason = std::strerror(ok ? errno : problem);
  unlink(fresh.c_str());
  throw ConfigError(file.string() + ": the cell's changes cannot be kept: " + reason);
}

}  // namespace

ObjectChange CellChanges::take(std::uint16_t id, const std::string& name) {
  ObjectChange change{id, name, {}, {}, {}, false, {}};
  const auto found =
      std::find_if(objects.begin(), objects.end(), [id](const auto& known) { return known.id == id; });
  if (found == objects.end()) return change;
  change = std::move(*found);
  objects.erase(found);
  return change;
}

void CellChanges::note_added(std::uint16_t id, const std::string& name, const std::string& description) {
  objects.push_back({id, name, description, {}, {}, false, {}});
  next_id = id + 1U;
}

void CellChanges::note_moved(std::uint16_t id, const std::string& name, const geometry::Pose& X_WO,
                             std::optional<int> guard_vox) {
  ObjectChange change = take(id, name);
  change.carrier.reset();
  change.X_WO = X_WO;
  if (guard_vox) change.guard_vox = guard_vox;
  objects.push_back(std::move(change));
}

void CellChanges::note_removed(std::uint16_t id, const std::string& name) {
  if (!take(id, name).description.empty()) return;  // a command added it, so nothing of it remains
  objects.push_back({id, name, {}, {}, {}, true, {}});
}

void CellChanges::note_attached(std::uint16_t id, const std::string& name, const Carrier& carrier) {
  ObjectChange change = take(id, name);
  change.carrier = carrier;
  objects.push_back(std::move(change));
}

std::optional<Carrier> CellChanges::carrier_of(const runtime::ObjectConfig& object,
                                               const runtime::CellConfig& cell) const {
  for (const ObjectChange& change : objects) {
    if (change.id == object.id) return change.carrier;
  }
  if (!object.hold || object.hold->arm.empty()) return std::nullopt;
  const runtime::ArmConfig& arm = cell.arm(object.hold->arm);
  return Carrier{arm.name, object.hold->frame.empty() ? last_link_of(arm) : object.hold->frame,
                 object.hold->X_FO};
}

std::string last_link_of(const runtime::ArmConfig& arm) {
  return arm.dh.empty() ? arm.tip_link : arm.dh.back().link;
}

CellChanges no_changes(const runtime::CellConfig& cell) {
  CellChanges changes;
  for (const runtime::ObjectConfig& object : cell.objects)
    changes.next_id = std::max(changes.next_id, object.id + 1U);
  return changes;
}

void apply(const CellChanges& changes, runtime::CellConfig& cell) {
  for (const ObjectChange& change : changes.objects) {
    runtime::ObjectConfig object;
    if (change.description.empty()) {
      const auto found = find_object(cell, change.id);
      if (found == cell.objects.end() || found->name != change.name) throw mismatch(change, cell);
      object = std::move(*found);
      cell.objects.erase(found);
    } else {
      object = runtime::read_object_text(change.description, cell);
      object.id = change.id;
    }
    if (change.removed) continue;
    if (change.X_WO) object.X_WO = *change.X_WO;
    if (change.guard_vox) {
      object.profile.guard_vox = *change.guard_vox;
      object.pose_error_m = *change.guard_vox * cell.voxel_size_m.reference_m();
    }
    cell.objects.push_back(std::move(object));
  }
}

void write_changes(const CellChanges& changes, const runtime::CellConfig& cell,
                   const std::filesystem::path& file) {
  nlohmann::json objects = nlohmann::json::array();
  for (const ObjectChange& change : changes.objects) {
    nlohmann::json object = {{"id", change.id}, {"name", change.name}};
    if (!change.description.empty()) object["added"] = change.description;
    if (change.X_WO) object["moved"] = pose_json(*change.X_WO);
    if (change.guard_vox) object["guard_vox"] = *change.guard_vox;
    if (change.removed) object["removed"] = true;
    if (change.carrier) {
      nlohmann::json carried = pose_json(change.carrier->X_FO);
      carried["arm"] = change.carrier->arm;
      carried["frame"] = change.carrier->frame;
      object["carried"] = carried;
    }
    objects.push_back(std::move(object));
  }
  const nlohmann::json all = {{"cell", cell.name},
                              {"cell_file", file_hash(cell.file)},
                              {"next_id", changes.next_id},
                              {"objects", objects}};
  replace_file(file, all.dump(1) + '\n');
}

std::optional<CellChanges> read_changes(const runtime::CellConfig& cell, const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  const runtime::Fields reader(file, {kChangeKeys});
  CellChanges changes;
  reader.number("next_id", changes.next_id);
  for (const runtime::Fields& object : reader.sections("objects"))
    changes.objects.push_back(read_change(object));
  const std::string cell_name = reader.text("cell"), mark = reader.text("cell_file");
  reader.finish();
  if (cell_name != cell.name || mark != file_hash(cell.file)) {
    throw ConfigError(
        fmt::format("{}: was kept for cell {} as its file was then, and {} is another or was changed since; "
                    "remove the first to serve the cell as its file has it now",
                    file.string(), cell_name, cell.file.string()));
  }
  return changes;
}

}  // namespace phantom::wva_server
