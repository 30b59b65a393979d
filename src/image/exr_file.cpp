// SPDX-License-Identifier: MIT
// OpenEXR throws; every exception ends here.

#include "image/exr_file.h"

#include "base/assert.h"
#include "base/atomic_file.h"
#include "base/format.h"
#include "image/file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace kiln::image {
namespace {

class MemoryInput : public Imf::IStream {
public:
    MemoryInput(std::span<const std::byte> bytes, const char* name) : IStream(name), bytes_(bytes) {}
    bool read(char out[], int count) override {
        if (count < 0 || size_t(count) > bytes_.size() - at_) throw std::runtime_error("the file is cut short");
        std::memcpy(out, bytes_.data() + at_, size_t(count));
        at_ += size_t(count);
        return at_ < bytes_.size();
    }
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t position) override {
        if (position > bytes_.size()) throw std::runtime_error("the file is cut short");
        at_ = size_t(position);
    }

private:
    std::span<const std::byte> bytes_;
    size_t at_ = 0;
};

class MemoryOutput : public Imf::OStream {
public:
    explicit MemoryOutput(const char* name) : OStream(name) {}
    void write(const char bytes[], int count) override {
        data.resize(std::max(data.size(), at_ + size_t(count)));
        std::memcpy(data.data() + at_, bytes, size_t(count));
        at_ += size_t(count);
    }
    uint64_t tellp() override { return at_; }
    void seekp(uint64_t position) override { at_ = size_t(position); }

    std::vector<std::byte> data;

private:
    size_t at_ = 0;
};

FloatPixels decode(std::span<const std::byte> bytes, const std::string& name, int64_t most_pixels) {
    MemoryInput stream(bytes, name.c_str());
    Imf::InputFile file(stream, 1);
    const Imf::Header& header = file.header();
    const Imath::Box2i window = header.dataWindow();
    const int64_t width = int64_t(window.max.x) - window.min.x + 1, height = int64_t(window.max.y) - window.min.y + 1;
    if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide)
        throw std::runtime_error("its size is out of range");
    // No compression of the format makes more than some thousand bytes of one.
    if (double(width) * double(height) > 4096.0 * double(bytes.size()))
        throw std::runtime_error("more pixels than the file can hold");
    if (width * height > most_pixels)
        throw std::runtime_error(formatted("{} x {} pixels; at most {} are read", width, height, most_pixels));

    const Imf::ChannelList& channels = header.channels();
    std::vector<const char*> names;
    if (channels.findChannel("R") || channels.findChannel("G") || channels.findChannel("B")) {
        names = {"R", "G", "B"};
        if (channels.findChannel("A")) names.push_back("A");
    } else if (channels.begin() != channels.end()) {
        names = {channels.begin().name()};
    } else {
        throw std::runtime_error("it has no channels");
    }
    for (const char* channel : names) {
        const Imf::Channel* c = channels.findChannel(channel);
        if (c && (c->xSampling != 1 || c->ySampling != 1))
            throw std::runtime_error("subsampled channels are not supported");
    }

    FloatPixels out{int(width), int(height), int(names.size()), {}};
    out.values.resize(size_t(width) * size_t(height) * names.size());
    const size_t x_stride = sizeof(float) * names.size(), y_stride = x_stride * size_t(width);
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < names.size(); ++i) {
        // Addressed from pixel (0, 0) of the data window's coordinates, which may lie outside of it.
        const intptr_t base = reinterpret_cast<intptr_t>(out.values.data() + i) -
                              intptr_t(window.min.x) * intptr_t(x_stride) - intptr_t(window.min.y) * intptr_t(y_stride);
        frame.insert(names[i], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(base), x_stride, y_stride));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return out;
}

Result<void> save(const std::string& path, const Imf::Header& header, const Imf::FrameBuffer& frame, int height) {
    MemoryOutput stream(path.c_str());
    try {
        Imf::OutputFile file(stream, header, 1);
        file.setFrameBuffer(frame);
        file.writePixels(height);
    } catch (const std::exception& e) {
        return Error{formatted("cannot write {}: {}", path, e.what()), ErrorKind::Failed};
    }
    Result<AtomicFile> file = AtomicFile::create(path);
    if (!file) return file.error();
    if (Result<void> r = file->write(stream.data); !r) return r.error();
    return file->commit();
}

}  // namespace

Result<FloatPixels> decode_exr(std::span<const std::byte> bytes, const std::string& name, int64_t most_pixels) {
    const unsigned char magic[] = {0x76, 0x2f, 0x31, 0x01};
    if (bytes.size() < 4 || std::memcmp(bytes.data(), magic, 4) != 0)
        return Error{formatted("{}: not an OpenEXR file", name), ErrorKind::Input};
    try {
        return decode(bytes, name, most_pixels);
    } catch (const std::exception& e) {
        // The library begins its messages with its own words for the file.
        return Error{formatted("{}: broken OpenEXR: {}", name, one_line(e.what())), ErrorKind::Input};
    }
}

Result<FloatPixels> read_exr(const std::string& path, int64_t most_pixels) {
    Result<std::vector<std::byte>> bytes = read_bytes(path);
    if (!bytes) return bytes.error();
    return decode_exr(*bytes, path, most_pixels);
}

Result<void> write_exr(const std::string& path, int width, int height, int channels, std::span<const float> values) {
    KILN_ASSERT((channels == 3 || channels == 4) && values.size() == size_t(width) * size_t(height) * size_t(channels),
                "{} values for {} x {} x {}", values.size(), width, height, channels);
    std::vector<half> halves(values.size());
    for (size_t i = 0; i < values.size(); ++i) {
        const float v = values[i];
        halves[i] = half(std::isnan(v) ? 0.0f : std::clamp(v, -65504.0f, 65504.0f));
    }
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer frame;
    const size_t x_stride = sizeof(half) * size_t(channels);
    for (int i = 0; i < channels; ++i) {
        const char* name = &"R\0G\0B\0A"[2 * i];
        header.channels().insert(name, Imf::Channel(Imf::HALF));
        frame.insert(name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(halves.data() + i), x_stride,
                                      x_stride * size_t(width)));
    }
    return save(path, header, frame, height);
}

Result<void> write_exr_depth(const std::string& path, int width, int height, std::span<const float> metres) {
    KILN_ASSERT(metres.size() == size_t(width) * size_t(height), "{} values for {} x {}", metres.size(), width, height);
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    Imf::FrameBuffer frame;
    // The library reads through this pointer only; its interface has no const.
    char* first = reinterpret_cast<char*>(const_cast<float*>(metres.data()));
    frame.insert("Z", Imf::Slice(Imf::FLOAT, first, sizeof(float), sizeof(float) * size_t(width)));
    return save(path, header, frame, height);
}

}  // namespace kiln::image
