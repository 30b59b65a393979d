// SPDX-License-Identifier: MIT
// libjpeg reports errors by a call that must not return: the frame that calls setjmp() holds nothing with a destructor, all state is the
// caller's.

#include "image/jpeg_file.h"

#include "base/format.h"
#include "image/file.h"

// jpeglib.h takes size_t and FILE for granted.
#include <cstdio>
#include <jpeglib.h>

#include <jerror.h>

#include <array>
#include <csetjmp>
#include <utility>

namespace kiln::image {
namespace {

// Even a picture of one colour takes half a bit a block of 64 pixels, twice that with half as many blocks for the colours: what claims
// more is no picture, and must not take the memory of one.
constexpr double kMostPixelsAByte = 1024;

struct JpegCall {
    jpeg_decompress_struct jpeg{};
    jpeg_error_mgr errors{};
    std::jmp_buf away;
    std::string fault;
    bool cut_short = false;
    std::span<const std::byte> input;
    std::vector<uint8_t> raw;
};

JpegCall& call_of(j_common_ptr jpeg) { return *static_cast<JpegCall*>(jpeg->client_data); }

[[noreturn]] void on_error(j_common_ptr jpeg) {
    std::array<char, JMSG_LENGTH_MAX> text{};
    jpeg->err->format_message(jpeg, text.data());
    call_of(jpeg).fault = text.data();
    std::longjmp(call_of(jpeg).away, 1);
}
// Level -1 is a warning: the library goes on with grey where data are missing.
void on_message(j_common_ptr jpeg, int level) {
    const int what = jpeg->err->msg_code;
    if (level < 0 && (what == JWRN_JPEG_EOF || what == JWRN_HIT_MARKER || what == JWRN_NOT_SEQUENTIAL ||
                      what == JWRN_HUFF_BAD_CODE || what == JWRN_MUST_RESYNC))
        call_of(jpeg).cut_short = true;
}

bool decode(JpegCall* call) {
    if (setjmp(call->away)) return false;
    jpeg_decompress_struct* const jpeg = &call->jpeg;
    jpeg_create_decompress(jpeg);
    jpeg_mem_src(jpeg, reinterpret_cast<const unsigned char*>(call->input.data()), call->input.size());
    jpeg_read_header(jpeg, TRUE);
    if (jpeg->image_width > JDIMENSION(kMaxSide) || jpeg->image_height > JDIMENSION(kMaxSide)) {
        call->fault = "more than the largest picture's pixels a side";
        return false;
    }
    if (double(jpeg->image_width) * double(jpeg->image_height) >
        kMostPixelsAByte * double(call->input.size()) + 65536.0) {
        call->fault = "more pixels than the file can hold";
        return false;
    }
    if (jpeg->num_components != 1 && jpeg->num_components != 3) {
        call->fault = "neither grey nor colour (CMYK?)";
        return false;
    }
    jpeg->out_color_space = jpeg->num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_start_decompress(jpeg);
    const size_t row_bytes = size_t(jpeg->output_width) * size_t(jpeg->output_components);
    call->raw.resize(row_bytes * jpeg->output_height);
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = call->raw.data() + row_bytes * jpeg->output_scanline;
        jpeg_read_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_decompress(jpeg);
    if (call->cut_short) call->fault = "it is cut short or damaged";
    return !call->cut_short;
}

}  // namespace

bool is_jpeg(std::span<const std::byte> bytes) {
    return bytes.size() >= 3 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8} &&
           bytes[2] == std::byte{0xff};
}

Result<Pixels> decode_jpeg(std::span<const std::byte> bytes, const std::string& name) {
    if (!is_jpeg(bytes)) return Error{formatted("{}: not a JPEG file", name), ErrorKind::Input};
    JpegCall call;
    call.input = bytes;
    call.jpeg.err = jpeg_std_error(&call.errors);
    call.jpeg.client_data = &call;
    call.errors.error_exit = on_error;
    call.errors.emit_message = on_message;
    const bool done = decode(&call);
    Pixels out{int(call.jpeg.output_width), int(call.jpeg.output_height), call.jpeg.output_components, 8, {}};
    jpeg_destroy_decompress(&call.jpeg);
    if (!done) return Error{formatted("{}: broken JPEG: {}", name, call.fault), ErrorKind::Input};
    out.values.assign(call.raw.begin(), call.raw.end());
    return out;
}

}  // namespace kiln::image
