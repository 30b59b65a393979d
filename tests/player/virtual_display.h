// SPDX-License-Identifier: MIT
// A display without a screen (Xvfb) for one test: found free by the server itself, gone with this object or with the test's process. What is
// on its screen can be read from the file that the server keeps it in.
#pragma once

#include "temp_folder.h"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace kiln {

class VirtualDisplay {
public:
    VirtualDisplay() {
        int ends[2];
        if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
        server_ = ::fork();
        if (server_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            const int nowhere = ::open("/dev/null", O_RDWR);
            ::dup2(nowhere, 0), ::dup2(nowhere, 1), ::dup2(nowhere, 2);
            ::close(ends[0]);
            const std::string fd = std::to_string(ends[1]), folder = folder_.string();
            ::execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "640x480x24", "-nolisten", "tcp",
                     "-noreset", "-fbdir", folder.c_str(), static_cast<char*>(nullptr));
            ::_exit(127);
        }
        ::close(ends[1]);
        // The server writes its number once it takes clients; an end without one is a server that did not start.
        for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) number_ += c;
        ::close(ends[0]);
        if (number_.empty()) throw std::runtime_error("Xvfb did not start: apt install xvfb");
        ::setenv("DISPLAY", (":" + number_).c_str(), 1);
        ::setenv("SDL_VIDEODRIVER", "x11", 1);
        ::unsetenv("WAYLAND_DISPLAY");
    }
    ~VirtualDisplay() {
        ::unsetenv("DISPLAY");
        ::unsetenv("SDL_VIDEODRIVER");
        ::kill(server_, SIGKILL);
        ::waitpid(server_, nullptr, 0);
        ::unlink(("/tmp/.X" + number_ + "-lock").c_str());
        ::unlink(("/tmp/.X11-unix/X" + number_).c_str());
    }
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

    /// Ends the server, as a crash would.
    void take_away() { ::kill(server_, SIGKILL); }
    std::string name() const { return ":" + number_; }

    struct Screen {
        int width = 0, height = 0;
        std::vector<std::array<uint8_t, 3>> rgb;
    };
    /// What the screen shows now: an X window dump, whose header is of big-endian words.
    Screen screen() const {
        std::ifstream in(folder_ / "Xvfb_screen0", std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(in), {}};
        const auto word = [&](size_t i) {
            uint32_t out = 0;
            for (size_t k = 0; k < 4; ++k) out = out << 8 | uint8_t(bytes[4 * i + k]);
            return out;
        };
        Screen out;
        if (bytes.size() < 100) return out;
        const size_t begin = word(0) + size_t{word(19)} * 12,
                     row = word(12);  // after the header and the table of colours
        out.width = int(word(4));
        out.height = int(word(5));
        for (size_t y = 0; y < size_t(out.height); ++y)
            for (size_t x = 0; x < size_t(out.width); ++x) {
                const size_t at = begin + y * row + 4 * x;
                out.rgb.push_back({uint8_t(bytes[at + 2]), uint8_t(bytes[at + 1]), uint8_t(bytes[at])});
            }
        return out;
    }

private:
    const TempFolder folder_;
    pid_t server_ = -1;
    std::string number_;
};

}  // namespace kiln
