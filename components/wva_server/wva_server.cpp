#include "components/wva_server/wva_server.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <exception>
#include <new>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"

namespace phantom::wva_server {
namespace {

using core::ConfigError;
using core::MissingError;

constexpr std::uint32_t kMaxId = 65534;

template <class T>
T value_or_throw(core::Expected<T> made) {
  if (!made) throw ConfigError(made.status().message());
  return std::move(*made);
}

/// Throws ConfigError if `file` is not in `folder`: commands may name files of the cell's own folder only.
void check_within(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const auto inner = std::filesystem::weakly_canonical(file);
  const auto outer = std::filesystem::canonical(folder);
  const auto [outer_end, inner_at] = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  if (outer_end == outer.end()) return;
  throw ConfigError("mesh: " + file.string() + " is not in the cell's folder; allowed: files in " +
                    outer.string());
}

std::string label_of(const std::string& name, std::uint16_t id) {
  return fmt::format("'{}' (object {})", name, id);
}

std::string carried_text(const ServedObject& object) {
  return fmt::format("{} is carried by arm '{}' at its link '{}'", label_of(object.config.name, object.id),
                     object.carrier->arm, object.carrier->frame);
}

std::string place_text(const geometry::Pose& X_WO) {
  const Eigen::Vector3d& p = X_WO.translation_m;
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) m", p.x(), p.y(), p.z());
}

ServedObject served(const runtime::ObjectConfig& config, runtime::CellBody&& body) {
  ServedObject object{
      .id = config.id, .config = config, .mesh_O = std::move(body.mesh_O), .notes = std::move(body.notes)};
  object.mesh_hash = object.mesh_O.content_hash();
  object.moments = geometry::solid_moments(object.mesh_O);
  return object;
}

}  // namespace

const char* name_of(WorkspaceOperation operation) {
  switch (operation) {
    case WorkspaceOperation::kAdd:
      return "add";
    case WorkspaceOperation::kMove:
      return "move";
    case WorkspaceOperation::kRemove:
      return "remove";
    case WorkspaceOperation::kAttach:
      return "attach";
    case WorkspaceOperation::kRelease:
      return "release";
    case WorkspaceOperation::kName:
      return "name";
    case WorkspaceOperation::kFreeze:
      return "freeze";
    case WorkspaceOperation::kDiscard:
      return "discard";
    case WorkspaceOperation::kRestore:
      return "restore";
  }
  return "?";
}

LiveCell::LiveCell(const runtime::CellConfig& cell, const AddLimits& limits, CellChanges changes)
    : cell_(cell), limits_(limits), live_(runtime::grid_of(cell), cell.merge), changes_(std::move(changes)) {}

core::Expected<layers::WorkspaceChange> LiveCell::activate(std::vector<runtime::CellBody> bodies,
                                                           std::uint64_t version,
                                                           const layers::ActivationOptions& options,
                                                           const OnObject& on_object) {
  std::map<std::uint16_t, ServedObject> objects;
  std::vector<layers::LiveBody> live;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const runtime::ObjectConfig& config = cell_.objects.at(i);
    const auto carrier = changes_.carrier_of(config, cell_);
    if (!carrier) live.push_back({&bodies[i].body, config.priority});
    ServedObject& object = objects.emplace(config.id, served(config, std::move(bodies[i]))).first->second;
    object.carrier = carrier;
    set_guard(object, config.profile, false);
  }
  auto change = live_.add(live, version, options,
                          [&](const layers::Body& body, const layers::BodyReport& report, std::size_t done) {
                            ServedObject& object = objects.at(body.id);
                            object.report = report;
                            on_object(object, done);
                          });
  if (!change) return change;
  objects_ = std::move(objects);
  for (auto& [id, object] : objects_) note_mesh(object);
  return change;
}

core::Expected<CellChange> LiveCell::apply(const WorkspaceCommand& command, std::uint64_t version,
                                           const layers::ActivationOptions& given) {
  // What is there may always be taken away.
  const bool bounded =
      command.operation != WorkspaceOperation::kRemove && command.operation != WorkspaceOperation::kAttach;
  core::WorkBudget budget(bounded ? limits_.steps : UINT64_MAX, given.keep_going);
  layers::ActivationOptions options = given;
  options.budget = &budget;
  try {
    switch (command.operation) {
      case WorkspaceOperation::kAdd:
        return add(command, version, options);
      case WorkspaceOperation::kMove:
        return move(command, version, options);
      case WorkspaceOperation::kRemove:
        return remove(command, version, options);
      case WorkspaceOperation::kAttach:
        return attach(command, version, options);
      case WorkspaceOperation::kRelease:
        return release(command, version, options);
      case WorkspaceOperation::kName:
      case WorkspaceOperation::kFreeze:
      case WorkspaceOperation::kDiscard:
      case WorkspaceOperation::kRestore:
        return core::Status::invalid_argument(
            "only what depth cameras see can be named, frozen, discarded or restored");
    }
    return core::Status::invalid_argument("no such operation; allowed: add, move, remove, attach, release");
  } catch (const ConfigError& problem) {
    if (budget.ended() && !budget.exceeded())
      return core::Status(core::ErrorCode::kUnavailable, "was ended while it was being carried out");
    return core::Status::invalid_argument(problem.what());
  } catch (const MissingError& problem) {
    return core::Status::not_found(problem.what());
  } catch (const std::bad_alloc&) {
    return core::Status(core::ErrorCode::kResourceExhausted, "not enough memory for this change");
  } catch (const std::exception& problem) {  // the server goes on whatever a command holds
    return core::Status(core::ErrorCode::kInternal, problem.what());
  }
}

std::string LiveCell::name_in(const WorkspaceCommand& command) const {
  if (command.operation == WorkspaceOperation::kAdd) {
    try {
      return runtime::read_object_text(command.description, cell_).name;
    } catch (const std::exception&) {
      return "";  // refused when it is carried out
    }
  }
  const auto object = command.object.empty() ? objects_.find(command.id) : objects_.end();
  return object != objects_.end() ? object->second.config.name : command.object;
}

core::Expected<layers::WorkspaceChange> LiveCell::begin_live(const workspace::LayerProfile& profile,
                                                             std::uint64_t version) {
  for (const auto& [id, object] : objects_)
    if (messages::is_live(id) || messages::is_live_name(object.config.name))
      return core::Status::invalid_argument(label_of(object.config.name, id) +
                                            " has an id or a name of live matter");
  auto change = live_.put({{kLiveId, {}, profile, {}}}, version);
  has_live_ = has_live_ || change;
  return change;
}

core::Expected<layers::WorkspaceChange> LiveCell::put_live(std::vector<layers::ComputedObject> objects,
                                                           std::uint64_t version, int threads) {
  layers::ActivationOptions options;
  options.threads = threads;
  return live_.put(std::move(objects), version, options);
}

bool LiveCell::has(const std::string& name) const {
  return std::ranges::any_of(objects_, [&](const auto& entry) { return entry.second.config.name == name; });
}

core::Expected<std::uint16_t> LiveCell::find(const WorkspaceCommand& command) const {
  if (has_live_ &&
      (command.object.empty() ? messages::is_live(command.id) : messages::is_live_name(command.object)))
    return core::Status::invalid_argument(
        "'" + (command.object.empty() ? messages::live_name(command.id) : command.object) +
        "' is what depth cameras see; allowed: objects of the cell file and those that commands added");
  if (command.object.empty()) {
    if (objects_.contains(command.id)) return command.id;
    return core::Status::not_found(fmt::format("no object {} in cell {}", command.id, cell_.name));
  }
  const auto name = [](const auto& entry) { return entry.second.config.name; };
  const auto found = std::ranges::find(objects_, command.object, name);
  if (found != objects_.end()) return found->first;
  return core::Status::not_found(fmt::format("no object '{}' in cell {}; there are: {}", command.object,
                                             cell_.name, core::listed(objects_, name)));
}

/// The grid bounds what one more object can take, so a limit on what is there already bounds the total.
void LiveCell::check_room() const {
  if (objects_.size() >= limits_.objects)
    throw ConfigError(
        fmt::format("there are {} objects already; allowed: {} (commands.max_objects in wva_server's "
                    "configuration); remove some first",
                    objects_.size(), limits_.objects));
  const std::uint64_t bytes = live_.object_bytes() + live_.workspace().bytes();
  const auto mib = [](std::uint64_t amount) { return static_cast<double>(amount) / (1 << 20); };
  if (mesh_bytes_ > limits_.mesh_bytes)
    throw ConfigError(
        fmt::format("the meshes of all objects that were ever there take {:.0f} MiB, and stay published; "
                    "allowed: none is added above {:.0f} MiB; restart wva_server",
                    mib(mesh_bytes_), mib(limits_.mesh_bytes)));
  if (bytes <= limits_.voxel_bytes) return;
  throw ConfigError(
      fmt::format("the voxels of the {} objects take {:.0f} MiB; "
                  "allowed: none is added above {:.0f} MiB (max_voxels_mib in wva_server's configuration); "
                  "remove some first",
                  objects_.size(), mib(bytes), mib(limits_.voxel_bytes)));
}

void LiveCell::note_mesh(const ServedObject& object) {
  constexpr std::size_t kPartBytes = 12;  // of a vertex or a triangle
  if (meshes_.insert(object.mesh_hash).second)
    mesh_bytes_ += kPartBytes * (object.mesh_O.vertices_m.size() + object.mesh_O.triangles.size());
}

/// Who sets a guard by command says so how far the object may be from where it is put.
void LiveCell::set_guard(ServedObject& object, const workspace::LayerProfile& profile,
                         bool by_command) const {
  object.config.profile = profile;
  object.guard_m = profile.guard_vox * cell_.voxel_size_m.reference_m();
  if (by_command) object.config.pose_error_m = object.guard_m;
}

/// Once all ids were given away, those of removed objects are given again, from the one that was given first
/// on: of all that went, that one has been gone for 65,534 objects or so. What a command removed from the
/// cell file keeps its id, by which the kept changes name it.
std::uint16_t LiveCell::free_id() const {
  const auto taken = [this](std::uint32_t id) {
    return (has_live_ && messages::is_live(static_cast<std::uint16_t>(id))) ||
           objects_.contains(static_cast<std::uint16_t>(id)) ||
           std::ranges::any_of(changes_.objects,
                               [id](const ObjectChange& change) { return change.id == id; });
  };
  std::uint32_t id = changes_.next_id > kMaxId ? 1 : changes_.next_id;
  for (std::uint32_t tried = 0; tried < kMaxId; ++tried, id = id % kMaxId + 1)
    if (!taken(id)) return static_cast<std::uint16_t>(id);
  throw ConfigError("all 65534 object ids are in use; remove some objects first");
}

CellChange LiveCell::add(const WorkspaceCommand& command, std::uint64_t version,
                         const layers::ActivationOptions& options) {
  check_room();
  runtime::ObjectConfig config = runtime::read_object_text(command.description, cell_);
  for (const auto& [id, object] : objects_) {
    if (object.config.name == config.name)
      throw ConfigError(label_of(config.name, id) +
                        " is there already; move it, or give the new one another name");
  }
  if (has_live_ && messages::is_live_name(config.name))
    throw ConfigError("'" + config.name + "' is a name of what depth cameras see; give it another one");
  if (!config.mesh.empty()) check_within(config.mesh, cell_.file.parent_path());
  if (config.is_zone())
    throw ConfigError(
        "kind: protected_zone is for objects of the cell file, from which all processes know "
        "that it is no body; allowed: solid");
  const std::uint16_t id = config.id = free_id();
  geometry::MeshImportOptions import = limits_.mesh;
  import.keep_going = options.keep_going;
  runtime::CellBody body = runtime::load_body(config, cell_, import, options.budget);
  const layers::LiveBody added[] = {{&body.body, config.priority}};
  layers::WorkspaceChange change = value_or_throw(live_.add(added, version, options));
  ServedObject object = served(config, std::move(body));
  object.report = change.reports.front();
  set_guard(object, config.profile, false);
  const std::string message =
      fmt::format("added {} at {}: {}", label_of(config.name, id), place_text(config.X_WO), describe(object));
  note_mesh(object);
  objects_.emplace(id, std::move(object));
  changes_.note_added(id, config.name, command.description);
  return {id, config.name, message, std::move(change)};
}

/// Returns the object's configuration at the pose, and with the guard, that a move or release names.
runtime::ObjectConfig LiveCell::placed(const ServedObject& object, const WorkspaceCommand& command) const {
  runtime::ObjectConfig config = object.config;
  config.X_WO = command.X_WO;
  config.place = cell_.name;
  if (command.guard_vox) config.profile.guard_vox = *command.guard_vox;
  if (const auto checked = workspace::check_profile(config.profile); !checked)
    throw ConfigError("guard_vox: " + checked.message());
  return config;
}

CellChange LiveCell::move(const WorkspaceCommand& command, std::uint64_t version,
                          const layers::ActivationOptions& options) {
  ServedObject& object = objects_.at(value_or_throw(find(command)));
  if (object.carrier) throw ConfigError(carried_text(object) + "; release it first");
  const runtime::ObjectConfig config = placed(object, command);
  const layers::Body body = runtime::place_body(config, object.mesh_O, cell_);
  layers::WorkspaceChange change = value_or_throw(live_.move(body, version, options));
  object.report = change.reports.front();
  object.config.X_WO = command.X_WO;
  set_guard(object, config.profile, command.guard_vox.has_value());
  changes_.note_moved(object.id, config.name, command.X_WO, command.guard_vox);
  const std::string guard = command.guard_vox ? fmt::format(", guard {} voxels", *command.guard_vox) : "";
  return {object.id, config.name,
          fmt::format("moved {} to {}{}", label_of(config.name, object.id), place_text(command.X_WO), guard),
          std::move(change)};
}

CellChange LiveCell::remove(const WorkspaceCommand& command, std::uint64_t version,
                            const layers::ActivationOptions& options) {
  const std::uint16_t id = value_or_throw(find(command));
  layers::WorkspaceChange change = value_or_throw(
      objects_.at(id).carrier ? live_.renew(version, options) : live_.remove(id, version, options));
  const std::string name = objects_.at(id).config.name;
  objects_.erase(id);
  changes_.note_removed(id, name);
  return {id, name, "removed " + label_of(name, id), std::move(change)};
}

CellChange LiveCell::attach(const WorkspaceCommand& command, std::uint64_t version,
                            const layers::ActivationOptions& options) {
  ServedObject& object = objects_.at(value_or_throw(find(command)));
  if (object.carrier) throw ConfigError(carried_text(object) + " already; release it there first");
  if (object.config.is_zone())
    throw ConfigError(label_of(object.config.name, object.id) +
                      " is a protected zone, which is no body; allowed: to move or remove it");
  if (carried().size() >= messages::kMaxCarried)
    throw ConfigError(
        fmt::format("the arms carry {} objects already; allowed: no more", messages::kMaxCarried));
  layers::WorkspaceChange change = value_or_throw(live_.remove(object.id, version, options));
  object.carrier = Carrier{command.arm, command.frame, command.X_FO};
  changes_.note_attached(object.id, object.config.name, *object.carrier);
  return {object.id, object.config.name, "attached: " + carried_text(object), std::move(change)};
}

CellChange LiveCell::release(const WorkspaceCommand& command, std::uint64_t version,
                             const layers::ActivationOptions& options) {
  ServedObject& object = objects_.at(value_or_throw(find(command)));
  if (!object.carrier)
    throw ConfigError(label_of(object.config.name, object.id) + " is carried by no arm; it stands at " +
                      place_text(object.config.X_WO));
  if (!command.arm.empty() && command.arm != object.carrier->arm)
    throw ConfigError(carried_text(object) + ", not by '" + command.arm + "'");
  const runtime::ObjectConfig config = placed(object, command);
  const layers::Body body = runtime::place_body(config, object.mesh_O, cell_);
  const layers::LiveBody returned[] = {{&body, config.priority}};
  layers::WorkspaceChange change = value_or_throw(live_.add(returned, version, options));
  object.report = change.reports.front();
  object.config.X_WO = config.X_WO;
  set_guard(object, config.profile, command.guard_vox.has_value());
  object.carrier.reset();
  changes_.note_moved(object.id, config.name, config.X_WO, command.guard_vox);
  return {object.id, config.name,
          "released " + label_of(config.name, object.id) + " at " + place_text(config.X_WO),
          std::move(change)};
}

std::vector<messages::CarriedObject> LiveCell::carried() const {
  std::vector<messages::CarriedObject> all;
  for (const auto& [id, object] : objects_) {
    if (!object.carrier) continue;
    messages::CarriedObject& carried = all.emplace_back();
    carried.id = id;
    carried.arm = object.carrier->arm;
    carried.frame = object.carrier->frame;
    carried.X_FO = object.carrier->X_FO;
    carried.mesh_hash = object.mesh_hash;
    carried.mass_kg = object.config.mass_kg;
    const Eigen::Matrix3d inertia_kg_m2 = object.config.mass_kg * object.moments.inertia_m2;
    carried.centre_of_mass_m = object.moments.centre_m;
    carried.moments_kg_m2 = inertia_kg_m2.diagonal();
    carried.products_kg_m2 = {inertia_kg_m2(0, 1), inertia_kg_m2(0, 2), inertia_kg_m2(1, 2)};
  }
  return all;
}

std::string describe(const ServedObject& object) {
  const layers::BodyReport& report = object.report;
  std::string text =
      fmt::format("{} (object {}): {} triangles, {} boundary and {} interior voxels, {:.0f} ms",
                  object.config.name, object.id, report.mesh.triangles, report.boundary_voxels,
                  report.interior_voxels, 1e3 * (report.voxelise_s + report.layers_s));
  if (report.mesh.duplicate_triangles > 0) {
    text += fmt::format("; {} triangles came twice and were left out", report.mesh.duplicate_triangles);
  }
  if (!report.mesh.closed) {
    text += fmt::format(
        "; the mesh is not closed: lines along three axes voted on what is inside, "
        "its winding number decided on {} voxels",
        report.mesh.disputed_voxels);
  }
  return text;
}

}  // namespace phantom::wva_server
