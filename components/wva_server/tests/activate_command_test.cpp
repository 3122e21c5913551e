#include "components/wva_server/activate_command.hpp"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ActivateCommand : public TestCell {
 protected:
  /// Runs the command line and returns what it prints.
  nlohmann::json run(const std::string& arguments) const {
    ActivateRequest request;
    CLI::App app;
    add_options(app, request);
    app.parse(arguments + " --export " + out().string());
    std::ostringstream print;
    EXPECT_EQ(run_activate(request, {}, print), 0);
    EXPECT_EQ(print.str().find('\n'), print.str().size() - 1);  // one line
    return nlohmann::json::parse(print.str());
  }
  std::string refusal(const std::string& arguments) const {
    try {
      run(arguments);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  }
  std::filesystem::path out() const { return folder_ / "out.nrrd"; }
  std::string mesh(const std::string& rest) const {
    return "--mesh " + (folder_ / "post.stl").string() + " --voxel-size-m 0.01 --layers 2,3 --mu 32,20 " +
           rest;
  }
};

TEST_F(ActivateCommand, ActivatesAMesh) {
  const auto line = run(mesh("--scale 0.001 --pose \"0.0031 0.0031 0.0031 0 0 0\""));
  // A post of 4×4×30 voxels off the lattice lies in 5×5×31, with five voxels of layers on each side.
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 15, 41}));
  EXPECT_NEAR(line["origin_m"][2].get<double>(), -0.20, 1e-9);
  EXPECT_EQ(line["voxels"]["101"], 3 * 3 * 29);
  EXPECT_EQ(line["voxels"]["100"], 5 * 5 * 31 - 3 * 3 * 29);
  std::uint64_t all = 0;
  for (const auto& count : line["voxels"]) all += count.get<std::uint64_t>();
  EXPECT_EQ(all, 15U * 15U * 41U);
  EXPECT_TRUE(line["seconds"]["total"].is_number());
  EXPECT_GT(std::filesystem::file_size(out()), 100U);
}

TEST_F(ActivateCommand, TakesPosesInDegrees) {
  const auto line = run(mesh("--scale 0.001 --pose \"0.0031 0.0031 0.0031 90 0 0\""));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 41, 15}));
}

TEST_F(ActivateCommand, FitsAMeshToAnExtent) {
  const auto line = run(mesh("--fit-extent-m 0.3 --pose 0.0031,0.0031,0.0031,0,0,0"));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{15, 15, 41}));
}

TEST_F(ActivateCommand, WrapsTheGuardOnTheBody) {
  const auto line =
      run(mesh("--scale 0.001 --guard 2 --field mu --encoding raw --pose \"0.0031 0.0031 0.0031 0 0 0\""));
  EXPECT_EQ(line["size_vox"], (std::vector<int>{19, 19, 45}));
  EXPECT_GT(line["voxels"]["99"], 0);
  EXPECT_GT(std::filesystem::file_size(out()), 19U * 19U * 45U * 4U);
}

TEST_F(ActivateCommand, ActivatesACell) {
  const auto line = run("--cell " + cell().string() + " --field object");
  EXPECT_EQ(line["size_vox"], (std::vector<int>{80, 80, 50}));
  EXPECT_EQ(line["objects"].size(), 3U);
  EXPECT_GT(line["bricks"], 0);
}

TEST_F(ActivateCommand, RefusesWhatIsNotThereYetInPlainWords) {
  for (const char* method : {"surface", "dilation"}) {
    EXPECT_THAT(refusal(mesh(std::string("--method ") + method)),
                AllOf(HasSubstr(method), HasSubstr("not available"), HasSubstr("allowed: distance")));
  }
  EXPECT_THAT(refusal(mesh("--element sphere")), AllOf(HasSubstr("--element"), HasSubstr("dilation")));
  EXPECT_THAT(refusal(mesh("--inside 2")), AllOf(HasSubstr("--inside"), HasSubstr("allowed: 0")));
}

TEST_F(ActivateCommand, RefusesArgumentsThatContradictEachOther) {
  EXPECT_THAT(refusal(""), HasSubstr("--mesh, --cell"));
  EXPECT_THAT(refusal(mesh("--cell " + cell().string())), HasSubstr("exactly one"));
  EXPECT_THAT(refusal("--cell " + cell().string() + " --guard 1"), HasSubstr("cell file says"));
  EXPECT_THAT(refusal(mesh("--scale 0.001 --fit-extent-m 1")), HasSubstr("only one"));
  EXPECT_THAT(refusal("--mesh " + (folder_ / "post.stl").string()), HasSubstr("--voxel-size-m"));
}

TEST_F(ActivateCommand, RefusesValuesThatCannotBe) {
  const std::string post =
      "--mesh " + (folder_ / "post.stl").string() + " --scale 0.001 --voxel-size-m 0.01 ";
  EXPECT_THAT(refusal(post + "--layers 2,3 --mu 20,32"), HasSubstr("fall outwards"));
  EXPECT_THAT(refusal(post + "--layers 2 --mu 32,20"), HasSubstr("one per layer"));
  EXPECT_THAT(refusal(mesh("--pose \"1 2 3\"")), HasSubstr("six numbers"));
  EXPECT_THAT(refusal(mesh("--pose \"1 2 3 4 5 six\"")), HasSubstr("six numbers"));
  EXPECT_THAT(refusal(mesh("--scale 1000")), AllOf(HasSubstr("post.stl"), HasSubstr("scale")));
}

TEST_F(ActivateCommand, NamesAMissingMesh) {
  ActivateRequest request;
  request.mesh = folder_ / "nowhere.stl";
  request.voxel_size_m = 0.01;
  request.layers = {1};
  request.mu = {5.0};
  request.out = out();
  std::ostringstream print;
  EXPECT_THROW(run_activate(request, {}, print), core::MissingError);
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(ActivateCommand, NamesAFolderThatIsNotThere) {
  ActivateRequest request;
  request.cell = cell();
  request.out = "/no/such/folder/out.nrrd";
  std::ostringstream print;
  EXPECT_THROW(run_activate(request, {}, print), core::ConfigError);
}

}  // namespace
}  // namespace phantom::wva_server
