#include "components/phantom_sensing/workspace/share_inbox.hpp"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>

namespace phantom::phantom_sensing {
namespace {

/// FNV-1a over everything that decides what a share's process senses.
class Hash {
 public:
  void add(const void* bytes, std::size_t count) noexcept {
    const auto* byte = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < count; ++i) value_ = (value_ ^ byte[i]) * 0x100000001B3ULL;
  }
  template <class T>
  void add(const std::vector<T>& values) noexcept {
    add(values.data(), values.size() * sizeof(T));
  }
  void add_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    add(text.data(), text.size());
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325ULL;
};

/// Returns the place of a percept or a threat.
template <class Message>
PlacePercept place_of(const Message& message) noexcept {
  PlacePercept place;
  place.mu = message.mu_Pa_s_per_m;
  place.closeness = message.closeness;
  place.object = message.object;
  place.position_W_m = messages::eigen(message.position_m);
  place.velocity_W_m_s = messages::eigen(message.velocity_m_s);
  place.gradient.pgv_W_m = messages::eigen(message.pgv);
  place.gradient.strength = message.pgs;
  return place;
}

Threat threat_of(const messages::Threat& message) noexcept {
  Threat threat;
  static_cast<PlacePercept&>(threat) = place_of(message);
  threat.motion = message.motion;
  threat.contact = message.contact;
  threat.link = message.link;
  threat.sensor = message.sensor;
  return threat;  // the arm's process judges it again
}

}  // namespace

std::vector<std::string> share_partitions(const std::string& cell_partition, const Config& config,
                                          const PhantomModel& model,
                                          const percept::AllowedContact& contacts) {
  if (model.shares.empty()) return {};
  Hash hash;
  hash.add_file(config.file);
  hash.add(model.name.data(), model.name.size());
  contacts.for_each([&hash](std::uint16_t object, std::size_t link) {
    hash.add(&object, sizeof object);
    hash.add(&link, sizeof link);
  });
  Hash of_skin = hash;
  const robot::SkinLayout& skin = model.skin;
  for (const auto* values : {&skin.x_m, &skin.y_m, &skin.z_m, &skin.weight}) of_skin.add(*values);
  of_skin.add(skin.cluster_kind);
  for (const robot::SoftBody& body : model.soft_bodies) {
    of_skin.add(&body.object, sizeof body.object);
    of_skin.add(body.pressure_Pa.data(), sizeof body.pressure_Pa);
    of_skin.add(body.stiffness_Pa_per_m.data(), sizeof body.stiffness_Pa_per_m);
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < model.shares.size(); ++i) {
    const SkinShare& share = model.shares[i];
    Hash whole = share.has_own_workspace() ? hash : of_skin;
    if (share.has_own_workspace()) whole.add_file(config.shares[i].cell);
    names.push_back(fmt::format("{}{}skin-{:016x}-{}", cell_partition, cell_partition.empty() ? "" : "/",
                                whole.value(), share.name));
  }
  return names;
}

ShareInbox::ShareInbox(std::span<const SkinShare> shares, double wait_s)
    : count_(shares.size()), wait_ns_(core::from_seconds(wait_s)) {
  for (std::size_t i = 0; i < count_; ++i) shares_[i].own_workspace = shares[i].has_own_workspace();
  sem_init(&wake_, 0, 0);
}

ShareInbox::~ShareInbox() { sem_destroy(&wake_); }

void ShareInbox::offer(std::size_t share, const messages::DragField& field) noexcept {
  shares_[share].fields.write(field);
  sem_post(&wake_);
}
void ShareInbox::offer(std::size_t share, const messages::Percept& percept) noexcept {
  shares_[share].percepts.write(percept);
  sem_post(&wake_);
}

void ShareInbox::Share::read() noexcept {
  fields.read(field);
  percepts.read(percept);
}

/// Returns whether what has come was sensed on that basis.
bool ShareInbox::Share::take(const ShareBasis& basis) noexcept {
  const bool same_workspace = field.workspace_version == percept.workspace_version &&
                              (own_workspace || field.workspace_version == basis.workspace_version);
  if (!field.drag.valid || !percept.valid || field.slave_echo != basis.slave ||
      percept.slave_echo != basis.slave || field.gripper_echo != basis.gripper || !same_workspace ||
      field.mode != basis.mode)
    return false;
  sensed = {field.drag, static_cast<float>(percept.mu_Pa_s_per_m), percept.sensor, percept.muted_sensors, {}};
  for (const messages::Threat& threat : percept.threats) sensed.threats.push_back(threat_of(threat));
  sensed.reaction = field.reaction;
  if (!own_workspace) return true;
  sensed.place = place_of(percept);
  sensed.link = percept.link;
  sensed.carried_key = field.workspace_version;
  return true;
}

/// Returns whether the share's process has said that it senses nothing in that state.
bool ShareInbox::Share::declines(const ShareBasis& basis) const noexcept {
  return own_workspace && !field.drag.valid && field.slave_echo == basis.slave;
}

SensedShares ShareInbox::await(const ShareBasis& basis) noexcept {
  SensedShares sensed{};
  if (count_ == 0) return sensed;
  const bool retry = ticks_++ % kRetryEvery == 0;
  const core::Nanoseconds until_ns = core::monotonic_ns() + wait_ns_;
  const timespec due{until_ns / core::kNsPerSecond, until_ns % core::kNsPerSecond};
  while (true) {
    bool awaited = false;
    for (std::size_t i = 0; i < count_; ++i) {
      if (sensed[i] != nullptr) continue;
      shares_[i].read();
      if (shares_[i].take(basis)) {
        sensed[i] = &shares_[i].sensed;
      } else if (!shares_[i].declines(basis)) {
        awaited = awaited || retry || !shares_[i].rests();
      }
    }
    if (!awaited) break;
    if (sem_clockwait(&wake_, CLOCK_MONOTONIC, &due) != 0 && errno != EINTR) break;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    if (sensed[i] != nullptr || shares_[i].declines(basis))
      shares_[i].misses = 0;
    else if (!shares_[i].rests())
      ++shares_[i].misses;
  }
  return sensed;
}

std::bitset<kMaxShares> ShareInbox::resting() const noexcept {
  std::bitset<kMaxShares> resting;
  for (std::size_t i = 0; i < count_; ++i) resting[i] = shares_[i].rests();
  return resting;
}

}  // namespace phantom::phantom_sensing
