#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/console.hpp"

namespace phantom::phantom_session {
namespace {

TEST(LiveLine, TellsTorquesWorstSensorClassAndModelAge) {
  Collector collector(0.05, 0.01, {});
  EXPECT_EQ(collector.live_line(), "no percept yet");
  collector.on_link_names({"base", "turret", "gripper"});
  collector.on_object_name(2, "vice");
  messages::Percept sample;
  sample.valid = true;
  sample.mu_Pa_s_per_m = 20.0;
  sample.motion = percept::MotionClass::kDangerous;
  sample.link = 2;
  sample.object = 2;
  sample.joint_count = 3;
  sample.drag_torque_Nm = {-0.5, 0.0, 1.234};
  collector.on_percept(0, sample);
  StatusSample status;
  status.component = "phantom_sensing";
  status.figures["model_age"] = 0.62;
  collector.on_status(status);
  EXPECT_EQ(collector.live_line(),
            "drag -0.50 +0.00 +1.23\ngripper, μ 20 of vice, nearing | model age 0.6 ms");
  sample.mu_Pa_s_per_m = 0.0;
  collector.on_percept(0, sample);
  EXPECT_EQ(collector.live_line(), "drag -0.50 +0.00 +1.23\nfree | model age 0.6 ms");
  sample.muted_sensors = 7;
  collector.on_percept(0, sample);
  EXPECT_THAT(collector.live_line(), testing::HasSubstr("| 7 sensors muted |"));
  sample.valid = false;
  collector.on_percept(0, sample);
  EXPECT_THAT(collector.live_line(), testing::StartsWith("no percept"));
}

TEST(LiveLine, ALinkWithoutANameIsNumbered) {
  Collector collector(0.05, 0.01, {});
  messages::Percept sample;
  sample.valid = true;
  sample.mu_Pa_s_per_m = 9.0;
  sample.link = 5;
  sample.object = 3;
  collector.on_percept(0, sample);
  EXPECT_THAT(collector.live_line(), testing::HasSubstr("link 5, μ 9 of object 3"));
}

/// What a terminal of `columns` shows after these bytes: CR, LF, ESC[K (clears to the line's end), ESC[A
/// (up), and characters in UTF-8, which wrap. Fails at any other control.
std::vector<std::string> screen_after(const std::string& bytes, std::size_t columns) {
  std::vector<std::vector<std::string>> rows(1);
  std::size_t row = 0, column = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto c = static_cast<unsigned char>(bytes[i]);
    if (c == '\r') {
      column = 0;
    } else if (c == '\n') {
      if (++row == rows.size()) rows.emplace_back();
    } else if (bytes.compare(i, 3, "\033[K") == 0) {
      rows[row].resize(std::min(rows[row].size(), column));
      i += 2;
    } else if (bytes.compare(i, 3, "\033[A") == 0) {
      row -= row > 0 ? 1U : 0U;
      i += 2;
    } else if (c < 0x20U) {
      ADD_FAILURE() << "control character " << static_cast<int>(c);
    } else {
      if (column == columns) {
        column = 0;
        if (++row == rows.size()) rows.emplace_back();
      }
      std::string character(1, bytes[i]);
      while (i + 1 < bytes.size() && (static_cast<unsigned char>(bytes[i + 1]) & 0xC0U) == 0x80U)
        character += bytes[++i];
      if (rows[row].size() <= column) rows[row].resize(column + 1, " ");
      rows[row][column++] = character;
    }
  }
  std::vector<std::string> screen;
  for (const auto& cells : rows) {
    screen.emplace_back();
    for (const std::string& cell : cells) screen.back() += cell;
  }
  return screen;
}

/// All that `talk` writes to a console on a terminal of so many columns, in a process of its own.
std::string on_a_terminal(unsigned short columns, const std::function<void(Console&)>& talk) {
  winsize size{};
  size.ws_col = columns;
  size.ws_row = 25;
  int terminal = -1;
  std::fflush(stdout);  // what waits in the buffer would be written by the child, too
  const pid_t child = forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    {
      Console console;
      if (!console.is_terminal()) _exit(1);
      talk(console);
    }  // what it was given is written by its end
    _exit(0);
  }
  EXPECT_GT(child, 0);
  std::string bytes;
  std::array<char, 4096> some;
  for (ssize_t n = 0; (n = read(terminal, some.data(), some.size())) > 0;)
    bytes.append(some.data(), static_cast<std::size_t>(n));
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  close(terminal);
  return bytes;
}

TEST(Console, OverwritesWhatIsLiveAndKeepsWhatIsSaidOnATerminal) {
  const std::string bytes = on_a_terminal(24, [](Console& console) {
    console.say("All are ready.");
    console.show("no percept");
    for (int i = 0; i < 50; ++i)
      console.show("drag +0.01 +0.02 and very much more than fits\nμ 13 of gate_valve | age 0.2 ms");
    console.say("contact at 160 mm/s");
    console.show("drag +0.01\nfree");
    console.show("drag +0.03\nμ 9");
  });
  EXPECT_EQ(screen_after(bytes, 24),
            (std::vector<std::string>{"All are ready.", "contact at 160 mm/s", "drag +0.03", "μ 9"}));
  const std::string before = bytes.substr(0, bytes.find("contact"));
  const auto screen = screen_after(before, 24);
  EXPECT_EQ(screen[0], "All are ready.");
  EXPECT_EQ(screen.size(), 3U) << "fifty updates took more than two lines";
  EXPECT_THAT(bytes, testing::HasSubstr("drag +0.01 +0.02 and ve\r\n"))
      << "cut before the terminal's last column";
}

TEST(Console, TakesAwayWhatIsLive) {
  const std::string bytes = on_a_terminal(40, [](Console& console) {
    console.show("drag\nfree");
    console.show("");
    console.say("Ending the session.");
  });
  EXPECT_EQ(screen_after(bytes, 40)[0], "Ending the session.");
}

}  // namespace
}  // namespace phantom::phantom_session
