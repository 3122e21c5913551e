// Names in one place of a cell that stand for something in another: each one misspelt, and refused with its
// place.
#include "common/runtime/cell/cell_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "common/core/errors.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class CellNames : public testing::Test {
 protected:
  CellNames() {
    std::ofstream(folder_ / "arm.urdf")
        << R"(<robot name="r"><link name="base"/><link name="upper"/><link name="tool"/>
<joint name="j" type="revolute"><parent link="base"/><child link="upper"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="t" type="fixed"><parent link="upper"/><child link="tool"/></joint></robot>)";
  }
  /// Writes the cell with additions to its second object, to its arm, and to its end.
  std::filesystem::path cell(const std::string& object, const std::string& arm = "",
                             const std::string& urdf = "arm.urdf") const {
    const auto file = folder_ / "cell.yaml";
    std::ofstream(file) << "name: n\n"
                           "workspace: {min_m: [-1, -1, -1], max_m: [1, 1, 1], voxel_size_m: 0.1}\n"
                           "profile: {thickness_vox: [2], mu_Pa_s_per_m: [20]}\n"
                           "objects:\n"
                           "  - {name: post, primitive: {box: {size_m: [0.1, 0.1, 0.1]}}}\n"
                           "  - {name: probe, primitive: {box: {size_m: [0.3, 0.3, 0.3]}}"
                        << object
                        << "}\n"
                           "arms:\n"
                           "  - {name: left, urdf: "
                        << urdf << ", tip_link: tool, home: [0.5]" << arm << "}\n";
    return file;
  }
  void expect_refused(const std::filesystem::path& file, const testing::Matcher<std::string>& words) const {
    EXPECT_NO_THROW(load_cell(file)) << "the fault is in the names alone";
    EXPECT_THAT([&] { load_checked_cell(file); }, ThrowsMessage<core::ConfigError>(words));
  }
  std::filesystem::path folder_ = test::new_folder();
};

TEST_F(CellNames, ThatAreThereAreTaken) {
  for (const char* hold : {"", ", hold: {arm: left, frame: tool}", ", hold: {arm: left}",
                           ", hold: {frame: upper}", ", hold: {pose: {xyz_m: [0, 0, 1]}}"}) {
    EXPECT_NO_THROW(load_checked_cell(cell(hold))) << hold;
  }
  EXPECT_NO_THROW(
      load_checked_cell(cell("",
                             ", allowed_contact: [{object: post}, {object: probe, link: tool}], "
                             "interest_points: [{name: p, link: base, position_m: [0, 0, 0]}], "
                             "skin: [{link: tool, axes: [{from_m: [0, 0, 0], to_m: [0, 0, 1]}]}]")));
}

// Tries wva_server: a name in the cell that stands for nothing
TEST_F(CellNames, OfAHoldAreChecked) {
  const auto place = AllOf(HasSubstr("cell.yaml:6: objects[1] 'probe': hold."));
  expect_refused(cell(", hold: {arm: lefd}"),
                 AllOf(place, HasSubstr("arm: the cell has no arm 'lefd'; allowed: left")));
  expect_refused(
      cell(", hold: {arm: left, frame: toool}"),
      AllOf(place, HasSubstr("frame: 'toool' is no moving link of the arm; allowed: upper, tool")));
  expect_refused(cell(", hold: {arm: left, frame: base}"), HasSubstr("'base' is no moving link"));
  expect_refused(
      cell(", hold: {frame: toool}"),
      AllOf(place, HasSubstr("'toool' is no moving link of an arm of the cell; allowed: upper, tool")));
}

TEST_F(CellNames, OfAnArmAreChecked) {
  expect_refused(
      cell("", ", allowed_contact: [{object: pots}]"),
      AllOf(HasSubstr("cell.yaml: arm 'left': allowed_contact: object: no object is called 'pots'"),
            HasSubstr("allowed: post, probe")));
  expect_refused(cell("", ", allowed_contact: [{object: post, link: l9}]"),
                 HasSubstr("allowed_contact: link: 'l9' is no moving link of the arm; allowed: upper, tool"));
  expect_refused(
      cell("", ", interest_points: [{name: p, link: l7, position_m: [0, 0, 0]}]"),
      HasSubstr("interest_points: 'p': link: 'l7' is no link of the arm; allowed: base, upper, tool"));
  expect_refused(cell("", ", displaced: [{link: l6, volume_m3: 0.001}]"),
                 HasSubstr("displaced: link: 'l6' is no moving link of the arm; allowed: upper, tool"));
  expect_refused(cell("", ", skin: [{link: l8, axes: [{from_m: [0, 0, 0], to_m: [0, 0, 1]}]}]"),
                 HasSubstr("skin: link: 'l8' is no link of the arm"));
}

// Tries wva_server: an arm that cannot be loaded
TEST_F(CellNames, AnArmThatCannotBeLoadedIsRefused) {
  std::ofstream(folder_ / "other.urdf") << "<robot name='r'/>";
  expect_refused(cell("", "", "other.urdf"), HasSubstr("other.urdf: is not a usable URDF"));
}

TEST_F(CellNames, OfAllShippedCellsAreThere) {
  int cells = 0;
  for (const auto& folder : std::filesystem::directory_iterator(PHANTOM_SOURCE_DIR "/deploy/cells")) {
    if (!std::filesystem::exists(folder.path() / "cell.yaml")) continue;
    EXPECT_NO_THROW(load_checked_cell(folder.path() / "cell.yaml", CellArms::kOptional)) << folder.path();
    ++cells;
  }
  EXPECT_GT(cells, 5);
}

}  // namespace
}  // namespace phantom::runtime
