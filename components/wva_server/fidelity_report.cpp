#include "components/wva_server/fidelity_report.hpp"

#include <nlohmann/json.hpp>

#include "common/core/text.hpp"

namespace phantom::wva_server {
namespace {

using layers::Deviation;
using nlohmann::json;

std::string order_text(int order) {
  return order == workspace::kOrderGuard ? "guard" : std::to_string(order);
}

std::string row(const FidelityHead& head, const layers::LayerFidelity& layer, const char* side,
                const Deviation& d) {
  return core::formatted("%s,%s,%.9g,%s,%zu,%.4f,%.4f,%.4f,%.4f\n", order_text(layer.order).c_str(), side,
                         layer.offset_vox, head.method.c_str(), d.faces, d.mean_vox, d.rms_vox, d.min_vox,
                         d.max_vox);
}

json object(const Deviation& d) {
  return {{"faces", d.faces},
          {"mean_vox", d.mean_vox},
          {"rms_vox", d.rms_vox},
          {"min_vox", d.min_vox},
          {"max_vox", d.max_vox}};
}

}  // namespace

json sides_json(const workspace::VoxelSize& size) {
  return size.is_cube() ? json(size[0]) : json{size[0], size[1], size[2]};
}

std::string fidelity_csv(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers) {
  std::string text = "layer,side,offset_vox,method,faces,mean_vox,rms_vox,min_vox,max_vox\n";
  for (const auto& layer : layers) {
    text += row(head, layer, "all", layer.whole);
    for (std::size_t side = 0; side < layers::kSides; ++side)
      text += row(head, layer, layers::name_of(static_cast<layers::Side>(side)), layer.by_side[side]);
  }
  return text;
}

std::string fidelity_json(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers) {
  json list = json::array();
  for (const auto& layer : layers) {
    json sides = json::object();
    for (std::size_t side = 0; side < layers::kSides; ++side)
      sides[layers::name_of(static_cast<layers::Side>(side))] = object(layer.by_side[side]);
    list.push_back({{"layer", order_text(layer.order)},
                    {"offset_vox", layer.offset_vox},
                    {"all", object(layer.whole)},
                    {"sides", sides}});
  }
  const json report = {{"mesh", head.mesh},
                       {"method", head.method},
                       {"voxel_size_m", sides_json(head.voxel_size_m)},
                       {"layers_vox", head.layers_vox},
                       {"guard_vox", head.guard_vox},
                       {"layers", list}};
  return report.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace phantom::wva_server
