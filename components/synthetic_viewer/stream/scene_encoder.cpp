#include "components/synthetic_viewer/stream/scene_encoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/scene/mesh_store.hpp"
#include "phantom_stream/scene_stream.hpp"

namespace phantom::synthetic_viewer {
namespace {

using SceneJson = nlohmann::json;

constexpr int kProtocol = 2;
constexpr core::Nanoseconds kHeartbeat_ns = core::kNsPerSecond / 5;
// Paint comes no more often than what a viewer is allowed allows beside the poses and the page's numbers:
// octets a second of both, and of paint at least and at most.
constexpr double kOctets_s = 48000.0, kMinPaint_s = 3000.0, kMaxPaint_s = 12000.0;
constexpr std::size_t kMaxPatches = 65535, kMaxMarks = 255;
constexpr double kLargest = 32767.0;  // of an int16

std::array<float, 3> floats(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }
std::array<double, 4> quaternion(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector4d xyzw = geometry::quaternion_xyzw(rotation);
  return {xyzw[0], xyzw[1], xyzw[2], xyzw[3]};
}

/// Returns the shortest text that is read as the same float; null where JSON has none.
std::string number_text(double value) {
  return std::isfinite(value) ? fmt::format("{}", static_cast<float>(value)) : "null";
}
std::string text_of(const Eigen::Vector3d& v) {
  return fmt::format("[{},{},{}]", number_text(v.x()), number_text(v.y()), number_text(v.z()));
}
std::string text_of(const Colour& c) { return text_of(Eigen::Vector3d(c[0], c[1], c[2])); }
std::string placement_text(const Eigen::Matrix4d& placement) {
  std::string text = "[";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      text += number_text(placement(row, column)) + (row < 2 || column < 3 ? "," : "]");
  return text;
}
std::string text_of(const geometry::Pose& pose) { return placement_text(placement_of({}, pose)); }
std::string json_words(const std::string& words) {
  return SceneJson(words).dump(-1, ' ', false, SceneJson::error_handler_t::replace);
}
template <class Said>
std::string words_text(const Said& words) {
  return json_of(words).dump(-1, ' ', false, SceneJson::error_handler_t::replace);
}
std::string camera_text(const Camera& camera) {
  return fmt::format(R"("eye_m":{},"look_at_m":{},"near_m":{},"far_m":{})", text_of(camera.eye_m),
                     text_of(camera.target_m), number_text(camera.near_m), number_text(camera.far_m));
}

template <class List, class Text>
std::string list_text(const List& list, const Text& text) {
  std::string result = "[";
  for (const auto& one : list) {
    if (result.size() > 1) result += ',';
    result += text(one);
  }
  return result + "]";
}

std::string kind_of(const SceneItem& item) {
  using enum SceneItem::Kind;
  return fmt::format("{}:{}",
                     item.kind == kObject  ? "object"
                     : item.kind == kPart  ? "part"
                     : item.kind == kBound ? "bound"
                                           : "other",
                     item.number);
}

/// Returns whether two items are the same but for mesh and name.
bool same_item(const SceneItem& a, const SceneItem& b) {
  return a.body == b.body && a.X_BM.rotation == b.X_BM.rotation &&
         a.X_BM.translation_m == b.X_BM.translation_m && a.colour == b.colour && a.opacity == b.opacity &&
         a.casts_shadow == b.casts_shadow && a.grown_m == b.grown_m;
}

bool same_mark(const DrawItem& a, const DrawItem& b) {
  return a.mesh == b.mesh && a.colour == b.colour && a.opacity == b.opacity && a.own_light == b.own_light &&
         a.W_from_mesh == b.W_from_mesh;
}

scene_stream::Mark mark_of(const DrawItem& mark, std::uint8_t views) {
  const Eigen::Matrix3f linear = mark.W_from_mesh.topLeftCorner<3, 3>();
  const Eigen::Vector3f scale = linear.colwise().norm().transpose();
  return {.shape = static_cast<std::uint8_t>(mark.mesh),
          .views = views,
          .own_light = mark.own_light,
          .origin_m = floats(mark.W_from_mesh.topRightCorner<3, 1>()),
          .turn = quaternion((linear * scale.cwiseInverse().asDiagonal()).cast<double>()),
          .scale = floats(scale),
          .colour = {mark.colour[0], mark.colour[1], mark.colour[2]},
          .opacity = mark.opacity};
}

double aspect_of(const PictureFormat& format) {
  return static_cast<double>(format.width_px) / format.height_px;
}

}  // namespace

void SceneEncoder::take(std::shared_ptr<const SceneBase> base) {
  if (!base) return;
  const bool other_scene = !base_ || base_->scene != base->scene;
  new_paint_ = new_paint_ || !base_ || base->state.skin.received_ns != told_skin_ns_;
  base_ = std::move(base);
  if (other_scene) compositor_.emplace(config_, cell_, *base_->scene);
  state_ = base_->state;
  new_base_ = true;
}

void SceneEncoder::compose(const LiveSamples& live, core::Nanoseconds now_ns) {
  if (!base_) return;
  const bool recorded = base_->recorded_ns != 0;
  if (!recorded) {
    if (live.arm.received_ns != 0) state_.arm = live.arm;
    if (live.percept.received_ns != 0) state_.percept = live.percept;
    if (live.master.received_ns != 0) state_.master = live.master;
    if (live.gripper.received_ns != 0) state_.gripper = live.gripper;
    for (std::size_t i = 0; i < state_.others.size(); ++i)
      if (live.others[i].received_ns != 0) state_.others[i].arm = live.others[i];
    state_.stops = live.stops;
  }
  const core::Nanoseconds at_ns = recorded ? base_->recorded_ns : now_ns;
  if (board_.size() == 0) put_cell();
  put_items(at_ns);
  put_view(at_ns);
  put_paint(now_ns);
  put_poses(at_ns, now_ns);
  new_base_ = false;
}

void SceneEncoder::put_cell() {
  const CellScene& scene = *base_->scene;
  const Frame empty = scene.frame({}, config_.staleness, 0);
  const std::vector<geometry::BoundingBox> boxes = scene.link_boxes();
  const std::size_t link_count = scene.arm().links().size();
  std::size_t body = 0;
  const auto body_text = [&](std::size_t link) {
    const bool is_link = body++ < link_count;
    const geometry::BoundingBox& box = boxes[link];
    const std::string corners =
        !is_link || box.empty()
            ? "null"
            : fmt::format("[{},{}]", fmt::join(box.min_m.data(), box.min_m.data() + 3, ","),
                          fmt::join(box.max_m.data(), box.max_m.data() + 3, ","));
    return fmt::format(R"({{"name":{},"link":{},"box":{}}})", json_words(scene.link_name(link)), link,
                       corners);
  };
  const auto line_text = [](const Line& line) {
    return fmt::format("[{},{}]", fmt::join(line.from_m.data(), line.from_m.data() + 3, ","),
                       fmt::join(line.to_m.data(), line.to_m.data() + 3, ","));
  };
  std::vector<int> numbers;
  for (int number = 1; number <= percept::kNodeCount; ++number) numbers.push_back(number);
  const auto node_text = [](int number) {
    const auto node = static_cast<percept::ViewNode>(number);
    return fmt::format(R"({{"number":{},"name":"{}","direction":{}}})", number, percept::node_name(node),
                       text_of(percept::node_direction(node)));
  };
  std::string bodies = list_text(scene.body_links(), body_text);
  bodies.pop_back();
  for (const std::string& name : scene.other_bodies())
    bodies += fmt::format(R"(,{{"name":{},"box":null}})", json_words(name));
  bodies += ']';
  const ToolViewConfig& tool = config_.tool_view;
  const std::string views = fmt::format(
      R"({{"main":{{"aspect":{},"fov_rad":{}}},"hit":{{"aspect":{},"fov_rad":{},"distance_m":{}}},)"
      R"("tool":{{"enabled":{},"aspect":{},"fov_rad":{},"link":{},"eye_m":{},"look_at_m":{}}}}})",
      number_text(aspect_of(config_.main_view.format)), number_text(config_.main_view.field_of_view_rad),
      number_text(aspect_of(config_.hit_view.format)), number_text(config_.hit_view.field_of_view_rad),
      number_text(at_scale(config_.hit_view.rule, scene.scale()).choice.distance_m), tool.enabled,
      number_text(aspect_of(tool.format)), number_text(tool.field_of_view_rad), scene.arm().joint_count(),
      text_of(Eigen::Vector3d(scene.scale() * tool.eye_m)),
      text_of(Eigen::Vector3d(scene.scale() * tool.look_at_m)));
  board_.put(
      "cell",
      {false,
       fmt::format(
           R"({{"type":"cell","protocol":{},"cell":{},"scene_Hz":{},"workspace":{{"min_m":{},"max_m":{}}},)"
           R"("scale":{},"floor_border_m":{},"floor_pitch_m":{},"lines":{},"line_colour":{},)"
           R"("to_key_light":{},"shadow_opacity":{},)"
           R"("paint_ramp":{},"bodies":{},"views":{},"nodes":{}}})",
           kProtocol, json_words(cell_), number_text(rate_Hz_), text_of(scene.min_m()),
           text_of(scene.max_m()), number_text(scene.scale()), number_text(empty.floor_border_m),
           number_text(empty.floor_pitch_m), list_text(empty.lines, line_text), text_of(empty.line_colour),
           text_of(to_key_light().cast<double>()), number_text(kShadowOpacity),
           list_text(paint_ramp(), [](const Colour& colour) { return text_of(colour); }), bodies, views,
           list_text(numbers, node_text))});
}

std::string SceneEncoder::item_text(const SceneItem& item, const std::string& name) const {
  const std::string paint =
      item.painted ? fmt::format("{},\"link\":{}", text_of(item.X_BM), item.link) : "null";
  return fmt::format(
      R"({{"type":"item","id":"{}","name":{},"mesh":"{}","body":{},"matrix":{},"colour":{},"opacity":{},)"
      R"("own_light":0,"shadow":{},"paint":{}}})",
      kind_of(item), json_words(name), hash_text(item.mesh->hash), item.body,
      placement_text(placement_of(item, item.X_BM)), text_of(item.colour), number_text(item.opacity),
      item.casts_shadow, paint);
}

/// Tells what has changed among the items. They do not depend on the arm's joints, but on its age.
void SceneEncoder::put_items(core::Nanoseconds at_ns) {
  const std::vector<SceneItem> items = base_->scene->items(state_, config_.staleness, at_ns);
  std::size_t still_there = 0;
  for (const SceneItem& item : items) {
    const auto [known, is_new] = items_.try_emplace(key_of(item));
    ++still_there;
    KnownItem& told = known->second;
    if (!is_new && !new_base_ && same_item(told.item, item)) continue;
    std::string name = base_->scene->item_name(state_, item);
    if (!is_new && told.mesh_hash == item.mesh->hash && told.name == name && same_item(told.item, item))
      continue;
    board_.put(kind_of(item), {false, item_text(item, name)});
    told = {item, item.mesh->hash, std::move(name)};
  }
  if (still_there == items_.size()) return;
  std::vector<std::uint64_t> present;
  for (const SceneItem& item : items) present.push_back(key_of(item));
  std::sort(present.begin(), present.end());
  std::erase_if(items_, [&](const auto& known) {
    if (std::binary_search(present.begin(), present.end(), known.first)) return false;
    const std::string kind = kind_of(known.second.item);
    board_.put_gone(kind, {false, fmt::format(R"({{"type":"item","id":"{}","gone":true}})", kind)});
    return true;
  });
}

void SceneEncoder::put_view(core::Nanoseconds at_ns) {
  std::pair banner{banner_words(state_, config_.staleness, at_ns), state_.stops.alarm};
  if (!new_base_ && banner_ == banner) return;
  const HitView& hit = base_->hit;
  const Compositor::Homes& homes = base_->homes;
  std::string zone = "null";
  if (hit.alert != 0)
    zone = fmt::format(
        R"({{"alert":{},"threatening":{},"node":{},"chosen":{},"held":{},"pgv":{},{},"title":{},"free_m":{}}})",
        hit.alert, hit.threatening, static_cast<int>(hit.node), static_cast<int>(state_.chosen), state_.hold,
        text_of(hit.situation.pgv), camera_text(homes.hit.camera), words_text(homes.title),
        list_text(homes.free_m, [](double free_m) { return fmt::format("{:.5f}", free_m); }));
  board_.put(
      "view",
      {false, fmt::format(R"({{"type":"view","banner":{},"alarm":{},"main":{{{},"note":{}}},"hit":{}}})",
                          words_text(banner.first), banner.second, camera_text(homes.main.camera),
                          words_text(homes.main_note), zone)});
  banner_ = std::move(banner);
}

void SceneEncoder::put_paint(core::Nanoseconds now_ns) {
  if (!new_paint_ || now_ns < paint_due_ns_) return;
  const SkinSample& skin = state_.skin;
  const std::size_t count = std::min(kMaxPatches, skin.felt.size());
  float greatest = 1e-6F;
  for (const SkinPatchSample& patch : skin.felt)
    for (const float place_m : patch.middle_m) greatest = std::max(greatest, std::abs(place_m));
  const float unit_m = greatest / static_cast<float>(kLargest);
  std::string bytes;
  scene_stream::Paint{.count = static_cast<std::uint16_t>(count),
                      .number = ++paint_number_,
                      .patch_m = static_cast<float>(skin.patch_m),
                      .unit_m = unit_m}
      .append_to(bytes);
  for (const SkinPatchSample& patch : std::span(skin.felt).first(count)) {
    scene_stream::Patch to{.link = static_cast<std::uint8_t>(patch.link), .closeness = patch.closeness};
    for (std::size_t i = 0; i < 3; ++i)
      to.middle[i] = static_cast<std::int16_t>(std::lround(patch.middle_m[i] / unit_m));
    to.append_to(bytes);
  }
  const double poses_s = poses_ ? static_cast<double>(poses_->octets.size()) * std::min(60.0, rate_Hz_) : 0.0;
  const double paint_s = std::clamp(kOctets_s - poses_s, kMinPaint_s, kMaxPaint_s);
  paint_due_ns_ = now_ns + core::from_seconds(static_cast<double>(bytes.size()) / paint_s);
  told_skin_ns_ = skin.received_ns;
  new_paint_ = false;
  board_.put("paint", {true, std::move(bytes)});
}

/// Returns the marks of all views, each once, with the views that show it.
std::string SceneEncoder::marks(std::size_t& count, const Compositor::Moment& moment) const {
  std::vector<std::pair<DrawItem, std::uint8_t>> shown;
  for (const View view : kViews) {
    if (view == View::kHit && base_->hit.alert == 0) continue;
    const auto bit = static_cast<std::uint8_t>(1U << static_cast<unsigned>(view));
    Frame aids;
    compositor_->add_aids(aids, view, moment, base_->hit);
    for (const DrawItem& mark : aids.items) {
      const auto known = std::ranges::find_if(
          shown, [&](const auto& one) { return (one.second & bit) == 0 && same_mark(one.first, mark); });
      if (known != shown.end()) {
        known->second |= bit;
      } else if (shown.size() < kMaxMarks) {
        shown.emplace_back(mark, bit);
      }
    }
  }
  std::string bytes;
  for (const auto& [mark, views] : shown) mark_of(mark, views).append_to(bytes);
  count = shown.size();
  return bytes;
}

void SceneEncoder::put_poses(core::Nanoseconds at_ns, core::Nanoseconds now_ns) {
  const Compositor::Moment moment{state_, base_->objects, base_->objects, at_ns};
  const std::vector<geometry::Pose> bodies = base_->scene->body_poses(state_);
  const double arm_age_s = age_s(state_.arm.received_ns, at_ns),
               percept_age_s = age_s(state_.percept.received_ns, at_ns);
  const bool heard = state_.arm.received_ns != 0;
  const bool known = state_.percept.valid && percept_age_s <= config_.staleness.percept_s;
  std::size_t mark_count = 0;
  const std::string mark_bytes = marks(mark_count, moment);
  using scene_stream::Poses;
  Poses poses{.body_count = static_cast<std::uint8_t>(bodies.size()),
              .mark_count = static_cast<std::uint8_t>(mark_count),
              .tool_free = static_cast<float>(heard ? compositor_->tool_free_share(moment) : 1.0),
              .closeness = static_cast<float>(known ? state_.percept.closeness : 0.0),
              .speed_m_s = static_cast<float>(known ? state_.percept.speed_m_s : 0.0)};
  if (heard) poses.flags |= Poses::kHeard;
  if (heard && arm_age_s > config_.staleness.slave_s) poses.flags |= Poses::kStale;
  if (known) poses.flags |= Poses::kPerceptKnown;
  if (heard && paint_shown(state_, config_.staleness, at_ns)) poses.flags |= Poses::kPainted;
  std::string content;  // but number, time and ages
  poses.append_to(content);
  for (const geometry::Pose& X_WB : bodies)
    scene_stream::Body{floats(X_WB.translation_m.cast<float>()), quaternion(X_WB.rotation)}.append_to(
        content);
  content += mark_bytes;
  if (poses_ && content == poses_content_ && now_ns - poses_ns_ < kHeartbeat_ns) return;
  poses_ns_ = now_ns;
  poses.number = ++poses_number_;
  poses.time_s = core::seconds(now_ns);
  poses.arm_age_s = static_cast<float>(arm_age_s);
  poses.percept_age_s = static_cast<float>(percept_age_s);
  std::string bytes;
  poses.append_to(bytes);
  bytes.append(content, Poses::kBytes);
  poses_content_ = std::move(content);
  poses_ = std::make_shared<const SceneMessage>(SceneMessage{true, std::move(bytes)});
}

}  // namespace phantom::synthetic_viewer
