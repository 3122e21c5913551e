#include "components/workspace_survey/page/candidates_page.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "components/workspace_survey/part_picture.hpp"

namespace phantom::workspace_survey {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxCards = 24;
constexpr std::size_t kMaxImageBytes = 8 << 20;

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

/// Returns a picture, PNG or JPEG, as a "data:" address.
std::string data_address(const std::string& bytes) {
  return std::string("data:image/") + (bytes.starts_with("\x89PNG") ? "png" : "jpeg") + ";base64," +
         base64(bytes);
}

/// Returns a picture as a "data:" address; "" for no file.
std::string image_address(const std::filesystem::path& file) {
  if (file.empty()) return "";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw core::MissingError(file.string() + ": cannot be read");
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const bool png = bytes.starts_with("\x89PNG"), jpeg = bytes.starts_with("\xFF\xD8\xFF");
  if (!(png || jpeg) || bytes.size() > kMaxImageBytes)
    throw core::ConfigError(file.string() + ": is not a picture; allowed: PNG or JPEG of at most 8 MiB");
  return data_address(bytes);
}

/// Returns the library's picture of a part; one made from its mesh if the library names none.
std::string image_of(const LibraryPart& part, const survey::PartModel& model) {
  if (!part.image.empty()) return image_address(part.image);
  const std::vector<std::uint8_t> png = part_picture(model);
  return data_address({png.begin(), png.end()});
}

template <class Vector>
json numbers(const Vector& v) {
  return {v[0], v[1], v[2]};
}

json part_json(const LibraryPart& part, const survey::PartModel& model) {
  json vertices = json::array(), nodes = json::array();
  for (const auto& v : model.mesh_O.vertices_m) vertices.push_back(numbers(v));
  for (const auto& n : model.nodes_O_m) nodes.push_back(numbers(n));
  return {{"name", part.name},    {"image", image_of(part, model)},
          {"vertices", vertices}, {"triangles", model.mesh_O.triangles},
          {"nodes", nodes},       {"edges", survey::sharp_edges(model)}};
}

class Page {
 public:
  explicit Page(const SurveyReport& report)
      : report_(report), found_(report.result.identification.candidates) {}

  json cards() {
    const auto all = survey::alternatives_of(report_.result.identification);
    for (std::size_t i = 0; i < std::min(all.size(), kMaxCards); ++i) {
      const survey::Candidate& candidate = found_[all[i].candidate];
      const survey::PoseFit& fit = *candidate.placements[all[i].placement].fit;
      add(candidate, fit.X_WO, i + 1, fmt::format("chi2 {:.1f} of {} degrees", fit.chi2, fit.degrees));
    }
    for (const survey::Candidate& candidate : found_) {
      const bool posed =
          std::ranges::any_of(candidate.placements, [](const auto& p) { return p.fit.has_value(); });
      if (posed || cards_.size() >= kMaxCards) continue;
      geometry::Pose upright;
      upright.rotation.setIdentity();
      upright.translation_m = report_.measurement.nodes.front().p_W_m;
      add(candidate, upright, 0, "agrees; its pose is not determined yet: measure three corners of a face");
    }
    return std::move(cards_);
  }
  json parts() { return std::move(parts_); }

 private:
  void add(const survey::Candidate& candidate, const geometry::Pose& X_WO, std::size_t number,
           const std::string& text) {
    const auto [at, is_new] = part_at_.try_emplace(candidate.part, parts_.size());
    if (is_new)
      parts_.push_back(
          part_json(report_.library.parts[candidate.part], report_.library.models[candidate.part]));
    json rotation = json::array();
    for (int row = 0; row < 3; ++row) rotation.push_back(numbers(Eigen::Vector3d(X_WO.rotation.row(row))));
    cards_.push_back({{"number", number},
                      {"posed", number > 0},
                      {"part", at->second},
                      {"rotation", rotation},
                      {"shift", numbers(X_WO.translation_m)},
                      {"text", text}});
  }

  const SurveyReport& report_;
  const std::vector<survey::Candidate>& found_;
  std::map<std::size_t, std::size_t> part_at_;  // of the library: of parts_
  json parts_ = json::array(), cards_ = json::array();
};

}  // namespace

std::string candidates_page(const SurveyReport& report, const std::string& pick,
                            const std::filesystem::path& view) {
  Page page(report);
  json measured = json::array();
  for (const survey::MeasuredNode& node : report.measurement.nodes)
    measured.push_back({{"name", node.name}, {"at", numbers(node.p_W_m)}});
  const json cards = page.cards();
  const auto all = survey::alternatives_of(report.result.identification).size();
  const json data = {
      {"title",
       fmt::format("What was measured? {} of {} parts agree, in {} poses{}",
                   report.result.identification.candidates.size(), report.library.parts.size(), all,
                   all > kMaxCards ? fmt::format(", of which the best {} are shown", kMaxCards) : "")},
      {"eye", numbers(report.measurement.eye_W_m)},
      {"measured", measured},
      {"pick", pick},
      {"view", image_address(view)},
      {"cards", cards},
      {"parts", page.parts()}};
  std::string safe;
  for (const char c : data.dump(-1, ' ', true))
    safe += c == '<' ? std::string("\\u003c") : std::string(1, c);  // no name ends the script
  std::string whole = kCandidatesPage;
  const std::string place = ">DATA<";
  whole.replace(whole.find(place), place.size(), ">" + safe + "<");
  return whole;
}

}  // namespace phantom::workspace_survey
