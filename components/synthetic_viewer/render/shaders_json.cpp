#include "components/synthetic_viewer/render/shaders_json.hpp"

#include <nlohmann/json.hpp>

#include "components/synthetic_viewer/render/shaders.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Returns a program's text for WebGL 2, which asks for precisions.
std::string for_web(std::string text, const char* defines) {
  const std::size_t end = text.find('\n');
  return "#version 300 es\nprecision highp float;\nprecision highp sampler3D;\n" + std::string(defines) +
         text.substr(end + 1);
}

nlohmann::json program_of(const char* vertex, const char* fragment, const char* defines = "") {
  return {{"vertex", for_web(vertex, defines)}, {"fragment", for_web(fragment, defines)}};
}

}  // namespace

const std::string& shaders_json() {
  static const std::string text =
      nlohmann::json{
          {"mesh", program_of(shaders::kMeshVertex, shaders::kMeshFragment)},
          {"painted", program_of(shaders::kMeshVertex, shaders::kMeshFragment, "#define PAINTED\n")},
          {"flat", program_of(shaders::kFlatVertex, shaders::kFlatFragment)},
          {"floor", program_of(shaders::kFloorVertex, shaders::kFloorFragment)},
          {"background", program_of(shaders::kBackgroundVertex, shaders::kBackgroundFragment)}}
          .dump();
  return text;
}

}  // namespace phantom::synthetic_viewer
