#include "common/geometry/mesh/mesh_answer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

namespace phantom::geometry::detail {
namespace {

using core::ErrorCode;
using core::Status;

constexpr std::array<char, 8> kMagic = {'P', 'H', 'M', 'E', 'S', 'H', '0', '1'};
constexpr std::size_t kMaxTextBytes = 1 << 16;

struct AnswerHead {
  std::array<char, 8> magic = kMagic;
  std::uint32_t has_mesh = 0;
  std::uint32_t text_bytes = 0;
  std::uint32_t vertices = 0;
  std::uint32_t triangles = 0;
  double scale = 1.0;
  std::uint32_t scale_from = 0, up_from = 0, up = 0, reserved = 0;
};
static_assert(sizeof(AnswerHead) == 48);

std::vector<std::uint8_t> with_text(AnswerHead head, std::string_view text) {
  text = text.substr(0, kMaxTextBytes);
  head.text_bytes = static_cast<std::uint32_t>(text.size());
  std::vector<std::uint8_t> bytes(sizeof head + text.size());
  std::memcpy(bytes.data(), &head, sizeof head);
  std::copy(text.begin(), text.end(), bytes.begin() + sizeof head);
  return bytes;
}

void take_text_lines(std::string_view text, LoadedMesh& mesh) {
  bool first = true;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    if (first) {
      mesh.format = text.substr(0, end);
    } else {
      mesh.notes.emplace_back(text.substr(0, end));
    }
    first = false;
    text.remove_prefix(end + 1);
  }
}

bool is_sound(const AnswerHead& head, const MeshImportOptions& options) {
  const auto known = [](std::uint32_t from) { return from <= static_cast<std::uint32_t>(KnownFrom::kGuess); };
  return head.magic == kMagic && head.has_mesh <= 1 && head.text_bytes <= kMaxTextBytes &&
         head.triangles <= options.max_triangles && head.vertices <= 3ULL * options.max_triangles &&
         std::isfinite(head.scale) && known(head.scale_from) && known(head.up_from) &&
         head.up <= static_cast<std::uint32_t>(UpAxis::kZ);
}

}  // namespace

std::vector<std::uint8_t> answer_head(const LoadedMesh& mesh) {
  std::string text = mesh.format + '\n';
  for (const std::string& note : mesh.notes) text += note + '\n';
  AnswerHead head;
  head.has_mesh = 1;
  head.vertices = static_cast<std::uint32_t>(mesh.vertices_m.size());
  head.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  head.scale = mesh.scale;
  head.scale_from = static_cast<std::uint32_t>(mesh.scale_from);
  head.up_from = static_cast<std::uint32_t>(mesh.up_from);
  head.up = static_cast<std::uint32_t>(mesh.up);
  return with_text(head, text);
}

std::vector<std::uint8_t> refusal(std::string_view problem) { return with_text({}, problem); }

std::size_t max_answer_bytes(const MeshImportOptions& options) {
  return sizeof(AnswerHead) + kMaxTextBytes + std::size_t{options.max_triangles} * (3 + 1) * 12;
}

core::Expected<LoadedMesh> mesh_of_answer(std::span<const std::uint8_t> bytes,
                                          const MeshImportOptions& options) {
  AnswerHead head;
  if (bytes.size() < sizeof head) return Status(ErrorCode::kInternal, "the importer ended without an answer");
  std::memcpy(static_cast<void*>(&head), bytes.data(), sizeof head);
  if (!is_sound(head, options))
    return Status(ErrorCode::kInternal, "the importer's answer is not one: is it of another version?");
  bytes = bytes.subspan(sizeof head);
  const Status cut_short(ErrorCode::kInternal, "the importer's answer was cut short");
  if (bytes.size() < head.text_bytes) return cut_short;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), head.text_bytes);
  if (head.has_mesh == 0) return Status(ErrorCode::kInvalidArgument, std::string(text));
  bytes = bytes.subspan(head.text_bytes);
  LoadedMesh mesh;
  if (!mesh_from_bytes(bytes.data(), bytes.size(), head.vertices, head.triangles, mesh)) return cut_short;
  take_text_lines(text, mesh);
  mesh.scale = head.scale;
  mesh.scale_from = static_cast<KnownFrom>(head.scale_from);
  mesh.up = static_cast<UpAxis>(head.up);
  mesh.up_from = static_cast<KnownFrom>(head.up_from);
  return mesh;
}

}  // namespace phantom::geometry::detail
