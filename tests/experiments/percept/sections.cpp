#include "tests/experiments/percept/sections.hpp"

namespace phantom::experiments {
namespace {

const std::array<std::string, 3> kAxes{"x [mm]", "y [mm]", "z [mm]"};
const char* column_of(Shown shown) { return shown == Shown::kLayer ? "layer" : "mu [Pa·s/m]"; }

double value_of(const workspace::Workspace& workspace, workspace::Index3 v, Shown shown) {
  if (shown == Shown::kMu) return static_cast<double>(workspace.mu(v));
  const int order = workspace.order(v);
  return order >= workspace::kOrderBoundary ? -1.0 : order;
}

}  // namespace

Table& section(Report& report, const std::string& name, const workspace::Workspace& workspace, int normal,
               double at_m, Shown shown) {
  const auto u = static_cast<std::size_t>(normal == 0 ? 1 : 0),
             v = static_cast<std::size_t>(normal == 2 ? 1 : 2);
  Table& table = report.table(name, {kAxes[u], kAxes[v], column_of(shown)});
  const workspace::GridSpec& grid = workspace.grid();
  Eigen::Vector3d through = grid.origin_m;
  through[normal] = at_m;
  const workspace::Index3 first = grid.index_of(through);
  for (std::int32_t j = 0; j < grid.size_vox[v]; ++j) {
    for (std::int32_t i = 0; i < grid.size_vox[u]; ++i) {
      std::array<std::int32_t, 3> at{first.x, first.y, first.z};
      at[u] = i;
      at[v] = j;
      const workspace::Index3 index{at[0], at[1], at[2]};
      const Eigen::Vector3d centre_mm = 1e3 * grid.centre_of(index);
      table.row({centre_mm[static_cast<int>(u)], centre_mm[static_cast<int>(v)],
                 value_of(workspace, index, shown)});
    }
  }
  return table;
}

Panel& section_panel(Report& report, Plot& plot, const std::string& title, const std::string& name,
                     const workspace::Workspace& workspace, int normal, double at_m, Shown shown) {
  const Table& table = section(report, name, workspace, normal, at_m, shown);
  const auto &x = table.columns()[0], &y = table.columns()[1];
  return plot.panel(title, x, y)
      .map(table, x, y, column_of(shown), shown == Shown::kLayer ? "layer (−1: body)" : "μ [Pa·s/m]")
      .equal_axes();
}

}  // namespace phantom::experiments
