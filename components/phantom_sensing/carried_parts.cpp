#include "components/phantom_sensing/carried_parts.hpp"

#include <algorithm>
#include <iterator>

#include "common/core/thread_config.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::Status;

constexpr std::size_t kMaxBodies = 32;  // laid out and kept: an object is often taken again

std::size_t bytes_of(const geometry::TriangleMesh& mesh) {
  return 12 * (mesh.vertices_m.size() + mesh.triangles.size());
}

Status refusal(const messages::CarriedObject& object, const Status& why) {
  return {why.code(),
          "object " + std::to_string(object.id) + ", carried by arm '" + object.arm + "': " + why.message()};
}

bool is_same(const messages::CarriedObject& a, const messages::CarriedObject& b) {
  return a.id == b.id && a.mesh_hash == b.mesh_hash && a.frame == b.frame &&
         a.X_FO.rotation == b.X_FO.rotation && a.X_FO.translation_m == b.X_FO.translation_m;
}

}  // namespace

std::uint64_t key_of(std::span<const messages::CarriedObject> own) {
  std::uint64_t key = 0;
  for (const messages::CarriedObject& object : own) {
    std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a
    const auto add = [&hash](std::uint64_t value) {
      for (int byte = 0; byte < 8; ++byte, value >>= 8U) hash = (hash ^ (value & 0xFFU)) * 0x100000001B3ULL;
    };
    add(object.id);
    add(object.mesh_hash);
    for (const char c : object.frame) add(static_cast<unsigned char>(c));
    key += hash;
  }
  return key != 0 || own.empty() ? key : 1;
}

CarriedParts::CarriedParts(const PhantomModel& model, const PerceptSettings& settings, int servo_priority)
    : model_(model), settings_(settings), servo_priority_(servo_priority) {}

Status CarriedParts::put(messages::MeshChunk chunk) {
  const std::uint64_t hash = chunk.mesh_hash;
  if (meshes_.contains(hash)) return Status::ok();
  auto mesh = assembler_.add(std::move(chunk));
  if (!mesh) return mesh.status();
  if (!*mesh) return Status::ok();
  if (mesh_bytes_ + bytes_of(**mesh) > kMaxMeshBytes)
    return {core::ErrorCode::kResourceExhausted,
            "a mesh is not kept, and its object cannot be carried: all take more than " +
                std::to_string(kMaxMeshBytes >> 20) + " MiB"};
  mesh_bytes_ += bytes_of(**mesh);
  meshes_.emplace(hash, **std::move(mesh));
  return Status::ok();
}

core::Expected<const robot::BodySkin*> CarriedParts::body(const messages::CarriedObject& object) {
  if (const auto known = bodies_.find(object.mesh_hash); known != bodies_.end()) return &known->second;
  const auto mesh = meshes_.find(object.mesh_hash);
  if (mesh == meshes_.end()) return Status(core::ErrorCode::kUnavailable, "its mesh has not come yet");
  auto skin = robot::lay_out_body(mesh->second, model_.skin_options);
  if (!skin) return skin.status();
  return &bodies_.emplace(object.mesh_hash, *std::move(skin)).first->second;
}

core::Expected<std::shared_ptr<CarryingSkin>> CarriedParts::skin_with(
    std::span<const messages::CarriedObject> carried) {
  std::vector<messages::CarriedObject> own;
  std::copy_if(carried.begin(), carried.end(), std::back_inserter(own),
               [this](const messages::CarriedObject& object) { return object.arm == model_.name; });
  if (std::equal(own.begin(), own.end(), newest_.begin(), newest_.end(), is_same)) return newest_skin_;
  std::shared_ptr<CarryingSkin> skin;
  if (!own.empty()) {
    auto made = make(own);
    if (!made) return made.status();
    skin = *std::move(made);
  }
  newest_ = std::move(own);
  newest_skin_ = skin;
  return skin;
}

core::Expected<std::shared_ptr<CarryingSkin>> CarriedParts::make(
    std::span<const messages::CarriedObject> own) {
  if (bodies_.size() > kMaxBodies) bodies_.clear();
  std::vector<robot::CarriedBody> bodies;
  std::vector<std::uint16_t> ids;
  for (const messages::CarriedObject& object : own) {
    const auto skin = body(object);
    if (!skin) return refusal(object, skin.status());
    bodies.push_back({object.frame, object.X_FO, *skin});
    ids.push_back(object.id);
  }
  auto layout = robot::skin_with_bodies(model_.arm, model_.skin, bodies, model_.skin_options);
  if (!layout) return layout.status();
  std::shared_ptr<CarryingSkin> skin;
  // Its workers inherit their scheduling from the thread that creates them.
  core::run_in_place(core::ThreadRole::kSensing, servo_priority_, [&] {
    const auto options = sensing_options(model_, settings_, layout->size());
    skin = std::make_shared<CarryingSkin>(*std::move(layout), options, std::move(ids));
  });
  skin->key = key_of(own);
  skin->boxes = boxes_of_share(model_, skin->layout);
  return skin;
}

}  // namespace phantom::phantom_sensing
