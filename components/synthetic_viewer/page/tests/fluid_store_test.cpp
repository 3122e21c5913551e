// The fluid as browsers get it: what is in an answer, what is refused and how, and who may ask.
#include "components/synthetic_viewer/stream/fluid_store.hpp"

#include <atomic>
#include <cstring>
#include <thread>

#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using testing::HasSubstr;
using workspace::Index3;
using workspace::VoxelBox;

/// Object 3, a box of 10 × 8 × 6 voxels with two layers of 2, and object 9, a single voxel of its only layer.
std::shared_ptr<workspace::Workspace> small_cell(std::uint64_t version = 1) {
  auto made = std::make_shared<workspace::Workspace>(
      workspace::GridSpec{{-0.5, 0.25, 1.0}, workspace::VoxelSize({0.01, 0.01, 0.02}), {64, 64, 64}},
      std::vector<float>{0.0F, 9.5F, 20.0F, 100.0F});
  made->version = version;
  const VoxelBox solid{{28, 29, 30}, {10, 8, 6}};
  const auto paint = [&](Index3 v, std::int8_t order, std::uint8_t code, std::uint16_t object) {
    const auto brick = made->edit_brick(workspace::brick_of(v));
    const std::size_t at = workspace::brick_offset(v);
    brick.order[at] = order;
    brick.mu_code[at] = code;
    brick.object[at] = object;
  };
  solid.grown(4).for_each([&](Index3 v) {
    std::int32_t away = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      away = std::max({away, solid.min[axis] - v[axis], v[axis] - solid.end()[axis] + 1});
    const int layer = (away + 1) / 2;
    paint(v, static_cast<std::int8_t>(layer == 0 ? 100 : layer), static_cast<std::uint8_t>(3 - layer), 3);
  });
  paint({5, 6, 7}, 1, 1, 9);
  return made;
}

class Fluid : public test::Page {
 protected:
  Fluid() { content_.fluid = &store_; }

  auto get(const std::string& path, const httplib::Headers& headers = {}) {
    auto result = client().Get(path.c_str(), headers);
    EXPECT_TRUE(result) << path;
    return result;
  }
  template <class T>
  static T number(const std::string& octets, std::size_t at) {
    T value{};
    if (at + sizeof value <= octets.size()) std::memcpy(&value, octets.data() + at, sizeof value);
    return value;
  }

  void put(std::shared_ptr<const workspace::Workspace> newest) {
    const std::lock_guard lock(mutex_);
    workspace_ = std::move(newest);
  }
  std::shared_ptr<const workspace::Workspace> newest() {
    const std::lock_guard lock(mutex_);
    return workspace_;
  }
  std::shared_ptr<const workspace::Workspace> workspace_ = small_cell();
  FluidStore store_{[this] { return newest(); }};
};

TEST_F(Fluid, ListsWhatThereIs) {
  serve();
  const auto told = nlohmann::json::parse(get("/fluid")->body);
  EXPECT_EQ(told.at("version"), 1);
  EXPECT_EQ(told.at("origin_m"), nlohmann::json::parse("[-0.5,0.25,1]"));
  EXPECT_EQ(told.at("voxel_size_m"), nlohmann::json::parse("[0.01,0.01,0.02]"));
  EXPECT_EQ(told.at("left_out"), 0);
  ASSERT_EQ(told.at("objects").size(), 3U);
  EXPECT_EQ(
      told["objects"][0],
      nlohmann::json::parse(
          R"({"object":0,"min_vox":[5,6,7],"size_vox":[37,35,33],"layers":[[1,20.0],[2,9.5],[100,100.0]]})"))
      << "of all together";
  EXPECT_EQ(
      told["objects"][1],
      nlohmann::json::parse(
          R"({"object":3,"min_vox":[24,25,26],"size_vox":[18,16,14],"layers":[[1,20.0],[2,9.5],[100,100.0]]})"));
  EXPECT_EQ(told["objects"][2].at("object"), 9);
}

TEST_F(Fluid, AShellIsRectanglesOfFaces) {
  serve();
  const std::string shell = get("/fluid/shell/3/2")->body;
  ASSERT_EQ(shell.size(), 32U + 6 * 12);
  EXPECT_EQ(number<float>(shell, 0), -0.5F);
  EXPECT_EQ(number<float>(shell, 12), 0.01F);
  EXPECT_EQ(number<float>(shell, 20), 0.02F);
  EXPECT_EQ(number<std::uint32_t>(shell, 24), 6U);
  std::set<int> sides;
  for (std::size_t face = 32; face < shell.size(); face += 12) {
    sides.insert(number<std::uint8_t>(shell, face + 10));
    EXPECT_EQ(number<std::int8_t>(shell, face + 11), 2);
    const int axis = number<std::uint8_t>(shell, face + 10) / 2;
    const std::array size{18, 16, 14};
    EXPECT_EQ(number<std::uint16_t>(shell, face + 6), size[static_cast<std::size_t>(axis + 1) % 3]);
    EXPECT_EQ(number<std::uint16_t>(shell, face + 8), size[static_cast<std::size_t>(axis + 2) % 3]);
  }
  EXPECT_EQ(sides, (std::set<int>{0, 1, 2, 3, 4, 5}));
}

TEST_F(Fluid, ASectionHasTheOrderOfEachVoxel) {
  serve();
  const std::string section = get("/fluid/section/3/y/26")->body;
  EXPECT_EQ(number<std::uint32_t>(section, 24), 1U);
  EXPECT_EQ(number<std::int32_t>(section, 28), 26);
  EXPECT_EQ(number<std::int32_t>(section, 32), 26) << "least z";
  EXPECT_EQ(number<std::int32_t>(section, 36), 24) << "least x";
  EXPECT_EQ(number<std::int32_t>(section, 40), 14);
  EXPECT_EQ(number<std::int32_t>(section, 44), 18);
  ASSERT_EQ(section.size(), 48U + 14 * 18);
  for (int x = 24; x < 42; ++x)
    for (int z = 26; z < 40; ++z)
      EXPECT_EQ(section[static_cast<std::size_t>(48 + (x - 24) * 14 + z - 26)],
                workspace_->order({x, 26, z}));
}

TEST_F(Fluid, WhoHasAnAnswerAlreadyIsToldSo) {
  serve();
  for (const char* path : {"/fluid", "/fluid/shell/3/1", "/fluid/section/3/z/30"}) {
    const auto first = get(path);
    const std::string tag = first->get_header_value("ETag");
    EXPECT_EQ(first->get_header_value("Cache-Control"), "private, no-cache");
    EXPECT_EQ(first->get_header_value_count("Cache-Control"), 1U);
    ASSERT_GT(tag.size(), 10U);
    const auto again = get(path, {{"If-None-Match", tag}});
    EXPECT_EQ(again->status, 304) << path;
    EXPECT_TRUE(again->body.empty());
    EXPECT_EQ(get(path, {{"If-None-Match", "\"other\""}})->status, 200);
    EXPECT_EQ(get(path)->body, first->body);
  }
  // A version that changes nothing of an object sends nothing of it again; what it changes comes anew.
  const std::string before = get("/fluid/shell/3/1")->get_header_value("ETag");
  auto next = small_cell(2);
  next->edit_brick(workspace::brick_of({5, 6, 7})).order[workspace::brick_offset({5, 6, 7})] = 2;
  put(next);
  EXPECT_EQ(get("/fluid/shell/3/1", {{"If-None-Match", before}})->status, 304);
  EXPECT_EQ(nlohmann::json::parse(get("/fluid")->body).at("version"), 2);
  EXPECT_EQ(get("/fluid/shell/9/1")->status, 404);
  EXPECT_EQ(get("/fluid/shell/9/2")->status, 200);
}

// Tries synthetic_viewer: a request for fluid that is not there, or too large
TEST_F(Fluid, WhatIsNotThereIsRefusedInWords) {
  serve();
  const auto refused = [&](const std::string& path, int status, const std::string& words) {
    const auto result = get(path);
    EXPECT_EQ(result->status, status) << path;
    EXPECT_THAT(result->body, HasSubstr(words)) << path;
  };
  refused("/fluid/shell/4/1", 404, "object 4 has no fluid in the workspace");
  refused("/fluid/shell/65535/1", 404, "has no fluid");
  refused("/fluid/shell/65539/1", 404, "has no fluid");             // not object 3
  refused("/fluid/shell/3/257", 404, "object 3 has no layer 257");  // not layer 1
  refused("/fluid/shell/3/0", 404, "object 3 has no layer 0");
  refused("/fluid/shell/3/3", 404, "object 3 has no layer 3");
  refused("/fluid/shell/3/-1", 404, "object 3 has no layer -1");
  refused("/fluid/section/3/y/24", 404, "lies at 25 to 40 along this axis, not at 24");
  refused("/fluid/section/3/y/41", 404, "not at 41");
  for (const char* other :
       {"/fluid/", "/fluid/shell/3", "/fluid/shell/3/1000", "/fluid/shell/3/x/5", "/fluid/section/3/5",
        "/fluid/shell/-3/1", "/fluid/shell/3/1/", "/fluid/section/3/w/5", "/fluid/section/3/x/-5",
        "/fluid/section/999999/x/5", "/fluid/section/3/x/99999"})
    refused(other, 404, "unknown path");
  // An object that reaches from one corner of a hall to the other, of so many layers of bricks.
  const auto put_hall = [&](int layers) {
    auto hall = std::make_shared<workspace::Workspace>(
        workspace::GridSpec{{0, 0, 0}, 0.01, {4096, 4096, 32 * layers}}, std::vector<float>{0.0F, 9.5F});
    for (const workspace::BrickKey key :
         {workspace::BrickKey{{0, 0, 0}}, workspace::BrickKey{{127, 127, layers - 1}}})
      hall->fill_brick(key, 1, 1, 3);
    put(hall);
  };
  // Larger than what is shown: a shell of a chequerboard, and an object that reaches through a whole hall.
  auto large = std::make_shared<workspace::Workspace>(workspace::GridSpec{{0, 0, 0}, 0.01, {96, 96, 96}},
                                                      std::vector<float>{0.0F, 9.5F});
  VoxelBox::of(large->grid()).for_each([&](Index3 v) {
    if ((v.x + v.y + v.z) % 2 != 0) return;
    const auto brick = large->edit_brick(workspace::brick_of(v));
    const std::size_t at = workspace::brick_offset(v);
    brick.order[at] = brick.mu_code[at] = 1;
    brick.object[at] = 3;
  });
  put(large);
  refused("/fluid/shell/3/1", 413, "the shell has more than 500000 rectangles; at most 500000 are shown");
  put_hall(2);
  refused("/fluid/shell/3/1", 413, "it reaches over 32768 bricks of voxels; at most 16384");
  put_hall(1);
  refused("/fluid/section/3/z/5", 413, "the section has 16777216 cells");
  EXPECT_EQ(get("/fluid/section/3/x/5")->status, 200);
  put(nullptr);
  refused("/fluid", 503, "the workspace has not come yet");
  refused("/fluid/shell/3/1", 503, "the workspace has not come yet");
  content_.fluid = nullptr;
  refused("/fluid", 404, "only a live viewer follows it");
}

TEST_F(Fluid, WhoMayWatchMaySeeItAndNobodyElse) {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve(config);
  for (const char* path : {"/fluid", "/fluid/shell/3/1", "/fluid/section/3/x/30"}) {
    EXPECT_EQ(get(path)->status, 401) << path;
    EXPECT_EQ(get(path, {{"Origin", "http://elsewhere.example"}})->status, 403) << path;
  }
  const auto login = client().Post("/login", R"({"secret":"watch-watch-watch"})", "application/json");
  ASSERT_EQ(login->status, 200);
  const std::string cookie = login->get_header_value("Set-Cookie");
  const httplib::Headers session{{"Cookie", cookie.substr(0, cookie.find(';'))}};
  for (const char* path : {"/fluid", "/fluid/shell/3/1", "/fluid/section/3/x/30"})
    EXPECT_EQ(get(path, session)->status, 200) << path;
}

// However many ask for what takes long, others and the stop are answered.
TEST_F(Fluid, ManyWhoAskHoldUpNobodyElse) {
  std::atomic<bool> goes_on{false};
  std::atomic<int> inside{0}, most{0};
  FluidStore slow([&] {
    const int now = ++inside;
    for (int before = most; before < now && !most.compare_exchange_weak(before, now);) {
    }
    phantom::test::eventually([&] { return goes_on.load(); });
    --inside;
    return newest();
  });
  content_.fluid = &slow;
  serve();
  std::atomic<int> served{0}, refused{0};
  std::vector<std::thread> askers;
  for (int i = 0; i < 24; ++i)
    askers.emplace_back([&] {
      const auto result = client().Get("/fluid/shell/3/1");
      ASSERT_TRUE(result);
      (result->status == 200 ? served : refused) += 1;
      if (result->status != 200) {
        EXPECT_EQ(result->status, 503);
        EXPECT_THAT(result->body, HasSubstr("ask again"));
      }
    });
  EXPECT_TRUE(phantom::test::eventually([&] { return refused == 22; }));
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
  EXPECT_EQ(get("/session")->status, 200);
  goes_on = true;
  for (std::thread& asker : askers) asker.join();
  EXPECT_EQ(served, 2);
  EXPECT_EQ(most, 2);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
