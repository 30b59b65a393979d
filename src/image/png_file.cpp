// SPDX-License-Identifier: MIT
// libpng reports errors by longjmp(): the frames that call setjmp() hold nothing with a destructor, all state is the caller's.

#include "image/png_file.h"

#include "base/assert.h"
#include "base/atomic_file.h"
#include "base/format.h"
#include "image/file.h"

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <utility>

namespace kiln::image {
namespace {

struct PngCall {
    std::string fault;
    // reading
    std::span<const std::byte> input;
    size_t at = 0;
    std::vector<uint8_t> raw;
    std::vector<png_bytep> rows;
    int width = 0, height = 0, channels = 0, bits = 0;
    // writing
    std::vector<std::byte> output;
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
    static_cast<PngCall*>(png_get_error_ptr(png))->fault = message;
    longjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)), 1);
}
void on_warning(png_structp, png_const_charp) {}

void take(png_structp png, png_bytep out, size_t count) {
    PngCall& call = *static_cast<PngCall*>(png_get_io_ptr(png));
    if (count > call.input.size() - call.at) png_error(png, "the file is cut short");
    std::memcpy(out, call.input.data() + call.at, count);
    call.at += count;
}

void put(png_structp png, png_bytep bytes, size_t count) {
    PngCall& call = *static_cast<PngCall*>(png_get_io_ptr(png));
    const std::byte* first = reinterpret_cast<const std::byte*>(bytes);
    call.output.insert(call.output.end(), first, first + count);
}
void flush(png_structp) {}

bool decode(png_structp png, png_infop info, PngCall* call) {
    if (setjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)))) return false;
    png_set_user_limits(png, kMaxSide, kMaxSide);
    png_set_chunk_malloc_max(png, 8u << 20);
    png_set_read_fn(png, call, take);
    png_read_info(png, info);
    png_set_expand(png);  // palettes, fewer than 8 bits, transparent colours
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    call->width = int(png_get_image_width(png, info));
    call->height = int(png_get_image_height(png, info));
    call->channels = png_get_channels(png, info);
    call->bits = png_get_bit_depth(png, info);
    const size_t row_bytes = png_get_rowbytes(png, info);
    // Deflate makes at most 1032 bytes of one: what claims more is no picture, and must not take the memory of one.
    if (double(row_bytes) * call->height > 1040.0 * double(call->input.size()) + 65536.0)
        png_error(png, "more pixels than the file can hold");
    call->raw.resize(row_bytes * size_t(call->height));
    call->rows.resize(size_t(call->height));
    for (size_t y = 0; y < call->rows.size(); ++y) call->rows[y] = call->raw.data() + y * row_bytes;
    png_read_image(png, call->rows.data());
    png_read_end(png, nullptr);
    return true;
}

bool encode(png_structp png, png_infop info, PngCall* call) {
    if (setjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)))) return false;
    const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
    png_set_write_fn(png, call, put, flush);
    png_set_user_limits(png, kMaxSide, kMaxSide);
    png_set_compression_level(png, 6);
    png_set_IHDR(png, info, png_uint_32(call->width), png_uint_32(call->height), call->bits, types[call->channels - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    png_write_image(png, call->rows.data());
    png_write_end(png, info);
    return true;
}

Result<void> write(const std::string& path, PngCall& call) {
    KILN_ASSERT(call.width > 0 && call.height > 0 && call.width <= kMaxSide && call.height <= kMaxSide, "{} x {}",
                call.width, call.height);
    const size_t row_bytes = call.raw.size() / size_t(call.height);
    call.rows.resize(size_t(call.height));
    for (size_t y = 0; y < call.rows.size(); ++y) call.rows[y] = call.raw.data() + y * row_bytes;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &call, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    const bool done = info && encode(png, info, &call);
    png_destroy_write_struct(&png, &info);
    if (!done)
        return Error{formatted("cannot write {}: {}", path, call.fault.empty() ? "out of memory" : call.fault),
                     ErrorKind::Failed};
    Result<AtomicFile> file = AtomicFile::create(path);
    if (!file) return file.error();
    if (Result<void> r = file->write(call.output); !r) return r.error();
    return file->commit();
}

}  // namespace

Result<Pixels> decode_png(std::span<const std::byte> bytes, const std::string& name) {
    if (bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) != 0) {
        return Error{formatted("{}: not a PNG file", name), ErrorKind::Input};
    }
    PngCall call;
    call.input = bytes;
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &call, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    const bool done = info && decode(png, info, &call);
    png_destroy_read_struct(&png, &info, nullptr);
    if (!done)
        return Error{formatted("{}: broken PNG: {}", name, call.fault.empty() ? "out of memory" : call.fault),
                     ErrorKind::Input};

    Pixels pixels{call.width, call.height, call.channels, call.bits, {}};
    pixels.values.resize(size_t(call.width) * size_t(call.height) * size_t(call.channels));
    for (size_t i = 0; i < pixels.values.size(); ++i) {
        pixels.values[i] = call.bits == 16 ? uint16_t(call.raw[2 * i] << 8 | call.raw[2 * i + 1]) : call.raw[i];
    }
    return pixels;
}

Result<Pixels> read_png(const std::string& path) {
    Result<std::vector<std::byte>> bytes = read_bytes(path);
    if (!bytes) return bytes.error();
    return decode_png(*bytes, path);
}

Result<void> write_png(const std::string& path, const Pixels& pixels) {
    PngCall call;
    call.width = pixels.width, call.height = pixels.height, call.channels = pixels.channels, call.bits = pixels.bits;
    const size_t bytes_each = pixels.bits == 16 ? 2 : 1;
    call.raw.resize(pixels.values.size() * bytes_each);
    for (size_t i = 0; i < pixels.values.size(); ++i) {
        if (bytes_each == 2) call.raw[2 * i] = uint8_t(pixels.values[i] >> 8);
        call.raw[bytes_each * i + bytes_each - 1] = uint8_t(pixels.values[i] & 0xff);
    }
    return write(path, call);
}

Result<void> write_png(const std::string& path, int width, int height, std::span<const uint8_t> rgba) {
    KILN_ASSERT(rgba.size() == size_t(width) * size_t(height) * 4, "{} bytes for {} x {}", rgba.size(), width, height);
    PngCall call;
    call.width = width, call.height = height, call.channels = 4, call.bits = 8;
    call.raw.assign(rgba.begin(), rgba.end());
    return write(path, call);
}

}  // namespace kiln::image
