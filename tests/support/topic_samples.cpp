#include "tests/support/topic_samples.hpp"

#include <map>
#include <stdexcept>

namespace phantom::test {
namespace {

// Values that differ from each other and have no bytes in common order: a swapped or shifted member shows.
std::uint64_t random_bits() {
  static std::uint64_t last = 17;
  last = last * 6364136223846793005U + 1442695040888963407U;
  return last ^ last >> 29;
}
double number(double least, double most) {
  return least + (most - least) * static_cast<double>(random_bits() >> 11) / 0x1p53;
}
template <class T>
T count(long long least, long long most) {
  const std::uint64_t span = static_cast<std::uint64_t>(most - least) + 1;
  return static_cast<T>(least + static_cast<long long>(random_bits() % span));
}
/// Of different lengths, so that padding differs; long ones fill their bound.
std::string text(std::size_t bound) {
  std::string words = bound > 255 ? "τ = 1,5 N·m, " : "";
  const std::size_t size = bound > 255 ? bound : 1 + random_bits() % bound;
  while (words.size() < size) words += static_cast<char>('a' + random_bits() % 26);
  return words;
}

void set(msg::Stamp& s) {
  s.sequence_number(count<std::uint64_t>(1, 1LL << 62));
  s.monotonic_ns(-count<std::int64_t>(0, 1LL << 62));
  s.utc_ns(count<std::int64_t>(0, 1LL << 62));
  s.session(random_bits());
}
void set(msg::Echo& e) {
  e.sequence_number(random_bits());
  e.monotonic_ns(count<std::int64_t>(0, 1LL << 62));
  e.session(random_bits());
}
void set(msg::Vector3& v, double most) {
  v.x(number(-most, most)), v.y(number(-most, most)), v.z(number(-most, most));
}
/// A turn that matrix and quaternion give exactly.
void set(msg::Pose& p, double most) {
  set(p.position_m(), most);
  p.qx(0.5), p.qy(-0.5), p.qz(-0.5), p.qw(0.5);
}

using Builder = std::function<void(const std::function<void(void*)>&)>;
template <class T>
std::pair<const std::string, Builder> entry(const dds::TopicSpec<T>& topic);

#include "phantom_contract/topic_samples.inc"

// What a range does not say.
void fit(msg::CameraPicture& m) { m.width(1280), m.height(719); }
void fit(msg::SensorPoints& m) { m.width(20'000), m.height(1); }
void fit(msg::DepthImage& m) { m.width(300), m.height(200), m.min_depth_m(0.25), m.max_depth_m(9.5); }
void fit(msg::OperatorCommand& m) { m.value(1.0), m.joint(-1); }
void fit(msg::HapticDevice& m) { m.measured_axes(63), m.grip_opening(0.375); }
void fit(msg::WorkspaceBrick& m) { m.by(70); }
void fit(msg::WorkspaceVersion& m) {
  m.voxel_size_m().x(0.004), m.voxel_size_m().y(0.005), m.voxel_size_m().z(0.008);
  for (std::size_t i = 0; i < m.palette().size(); ++i) m.palette()[i] = 0.25F * static_cast<float>(i);
  std::uint16_t id = 0;
  for (auto& one : m.carried()) {
    one.id(++id);
    one.moments_kg_m2().x(0.5), one.moments_kg_m2().y(0.25), one.moments_kg_m2().z(0.125);
  }
}
void fit(msg::MeshChunk& m) { m.chunk(5), m.chunk_count(6); }
void fit(msg::OccupancyChange& m) {
  m.size_x_vox(8192), m.size_y_vox(8192), m.size_z_vox(8192);
  std::uint16_t place = 0;
  for (auto& one : m.blocks()) one.x(place++ % 1024), one.y(place / 1024);
}
void fit(msg::SpaceView& m) {
  const std::size_t along_x = std::min<std::size_t>(m.ages().size(), 1024);
  m.size_x(static_cast<std::uint16_t>(along_x));
  m.size_y(static_cast<std::uint16_t>(m.ages().size() / along_x)), m.size_z(1);
}
void fit(msg::WorkspaceCommand& m) {
  m.operation(msg::WorkspaceOperation::WORKSPACE_MOVE);  // which uses X_WO and the guard
  m.X_FO(msg::Pose());
}

template <class T>
std::pair<const std::string, Builder> entry(const dds::TopicSpec<T>& topic) {
  return {topic.name, [](const std::function<void(void*)>& use) {
            T sample;
            set(sample);
            if constexpr (requires { fit(sample); }) fit(sample);
            use(&sample);
          }};
}

}  // namespace

void with_sample(const dds::TopicDescription& topic, const std::function<void(void*)>& use) {
  static const auto builders = entries<std::map<std::string, Builder>>();
  builders.at(topic.name)(use);
}

}  // namespace phantom::test
