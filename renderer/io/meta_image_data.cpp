// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/meta_image_data.h"

#include <zlib.h>

#include <algorithm>
#include <array>

#include "renderer/io/byte_stream.h"
#include "renderer/io/stored_type.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMostMetaImageFiles = 1 << 16;
constexpr const char* kDataField = "ElementDataFile";

/// "slice%03d.raw" as what is around the number, and how it is padded.
struct MetaImagePattern {
  std::string before, after = {};
  std::size_t width = 0;
  char padding = ' ';

  std::string name(std::int64_t number) const {
    const std::string digits = std::to_string(number);
    return before + std::string(width - std::min(width, digits.size()), padding) + digits + after;
  }
};

std::optional<MetaImagePattern> metaImagePattern(std::string_view word) {
  const auto percent = word.find('%');
  if (percent == std::string_view::npos) return std::nullopt;
  MetaImagePattern pattern{.before = std::string(word.substr(0, percent))};
  word.remove_prefix(percent + 1);
  if (word.starts_with('0')) pattern.padding = '0';
  for (; !word.empty() && word[0] >= '0' && word[0] <= '9'; word.remove_prefix(1))
    pattern.width = std::min<std::size_t>(pattern.width * 10 + std::size_t(word[0] - '0'), 20);
  if (word.empty() || (word[0] != 'd' && word[0] != 'i' && word[0] != 'u')) return std::nullopt;
  pattern.after = word.substr(1);
  return pattern;
}

/// "slice%03d.raw 1 40 1": the pattern, and the first, last and step of its numbers.
std::vector<std::string> numberedFiles(const MetaImageHeader& header, const MetaImagePattern& pattern,
                                       std::span<const std::string_view> words, std::int64_t slices) {
  std::array<std::int64_t, 3> numbers{1, 0, 1};
  for (std::size_t i = 0; i < std::min<std::size_t>(words.size(), 3); ++i) {
    const auto number = parseInteger(words[i]);
    if (!number || *number < 0 || *number > 1'000'000'000)
      throw header.bad(kDataField, "whole numbers after the pattern", words[i]);
    numbers[i] = *number;
  }
  const auto [first, last, step] = numbers;
  std::vector<std::string> names;
  for (std::int64_t i = 0; i < slices && (words.size() < 2 || first + i * step <= last); ++i)
    names.push_back(pattern.name(first + i * step));
  const bool more = words.size() >= 2 && (step < 1 || first + slices * step <= last);
  if (more || names.size() != std::size_t(slices))
    throw header.bad(kDataField, "numbers for as many files as DimSize ends with, " + std::to_string(slices),
                     header.require(kDataField));
  return names;
}

/// The names of the files, and into `axes` how many of the axes each file holds.
std::vector<std::string> metaImageFiles(const MetaImageHeader& header, std::span<const std::int64_t> dims,
                                        std::size_t& axes) {
  const std::string_view value = header.require(kDataField);
  const auto words = splitWords(value);
  if (words.empty()) throw header.bad(kDataField, "LOCAL, LIST, a file or a pattern", value);
  const bool list = words[0] == "LIST";
  const auto pattern = metaImagePattern(words[0]);
  axes = dims.size();
  if (!list && !pattern) return {std::string(value)};
  axes = dims.size() - 1;
  if (list && words.size() > 1) {
    const std::string_view number = words[1].substr(0, words[1].find_first_of("dD"));  // "2" or "2D"
    const auto given = parseInteger(number);
    if (!given || *given < 0) throw header.bad(kDataField, "LIST and the axes of each file", value);
    if (*given > 0 && *given <= std::int64_t(dims.size())) axes = std::size_t(*given);
  }
  std::uint64_t count = 1;
  for (std::size_t axis = axes; axis < dims.size(); ++axis)
    count = saturatingProduct(count, std::uint64_t(dims[axis]));
  if (count > kMostMetaImageFiles)
    throw header.unsupported(kDataField, "at most 65536 files", std::to_string(count));
  if (!list) return numberedFiles(header, *pattern, std::span(words).subspan(1), std::int64_t(count));
  if (header.listed.size() != count)
    throw header.bad(kDataField, "a list of " + std::to_string(count) + " files",
                     std::to_string(header.listed.size()));
  return header.listed;
}

/// Throws Error(badInput) unless the file can hold its elements.
void checkMetaImageFile(const MetaImageHeader& header, const MetaImageData& data, const fs::path& file) {
  const ByteStream stream(file, ByteStream::Encoding::plain, data.start);
  std::uint64_t holds = stream.largestSize();
  if (data.packedBytes > holds)
    throw header.bad("CompressedDataSize", "at most the file's " + std::to_string(holds) + " bytes",
                     std::to_string(data.packedBytes));
  constexpr std::uint64_t kDeflateLimit = 1032;  // the most that deflate expands
  if (data.packed) holds = saturatingProduct(data.packedBytes > 0 ? data.packedBytes : holds, kDeflateLimit);
  if (data.pieceBytes <= holds) return;
  throw Error(ErrorCode::badInput, shown(file) + ": DimSize of " + header.file + " needs " +
                                       byteCount(data.pieceBytes) + ", the file holds " +
                                       (data.packed ? "at most " : "") + byteCount(holds));
}

}  // namespace

MetaImageData findMetaImageData(const MetaImageHeader& header, const fs::path& path,
                                std::span<const std::int64_t> dims, std::uint64_t elementBytes) {
  MetaImageData data;
  data.packed = header.flag({"CompressedData"}, false);
  if (data.packed) data.packedBytes = std::uint64_t(header.integer("CompressedDataSize", 0, 0));
  const std::int64_t headerSize = header.integer("HeaderSize", 0, -1);
  data.start = std::uint64_t(std::max<std::int64_t>(headerSize, 0));
  data.atEnd = headerSize == -1;
  if (data.atEnd && data.packed) throw header.bad("HeaderSize", "0 or more for compressed data", "-1");

  std::size_t axes = dims.size();
  if (lowerCase(header.require(kDataField)) == "local") {
    data.files = {path};
    if (headerSize == 0) data.start = header.endOffset;
  } else {
    for (const std::string& name : metaImageFiles(header, dims, axes))
      data.files.push_back(resolveDataFile(path, kDataField, name));
  }
  if (data.files.size() > 1) data.packedBytes = 0;  // it is the size of all of them
  data.pieceBytes = elementBytes;
  for (const std::int64_t size : dims.first(axes))
    data.pieceBytes = saturatingProduct(data.pieceBytes, std::uint64_t(size));
  for (const fs::path& file : data.files) checkMetaImageFile(header, data, file);
  return data;
}

/// One of the files, unpacked if need be.
class MetaImageStream::File {
 public:
  File(const MetaImageData& data, const fs::path& path)
      : stream_(path, ByteStream::Encoding::plain, data.start),
        packed_(data.packed),
        pieceBytes_(data.pieceBytes) {
    left_ = data.packedBytes > 0 ? data.packedBytes : stream_.largestSize();
    if (data.atEnd) stream_.skip(stream_.largestSize() - std::min(data.pieceBytes, stream_.largestSize()));
    constexpr int kZlibOrGzip = 15 + 32;
    if (packed_ && ::inflateInit2(&inflater_, kZlibOrGzip) != Z_OK)
      throw Error(ErrorCode::tooLarge, shown(path) + ": no memory to unpack it");
  }
  ~File() { ::inflateEnd(&inflater_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  std::uint64_t position() const { return position_; }
  bool canSeek() const { return !packed_; }
  void skip(std::uint64_t count) {
    stream_.skip(count);
    position_ += count;
  }

  void read(std::span<std::byte> bytes) {
    if (packed_)
      unpack(bytes);
    else
      stream_.read(bytes);
    position_ += bytes.size();
  }

 private:
  /// One step of inflate, with more input if it needs some.
  int step() {
    if (inflater_.avail_in == 0) {
      const auto want = std::size_t(std::min<std::uint64_t>(left_, input_.size()));
      const std::size_t got = stream_.readSome(std::span(input_).first(want));
      left_ -= got;
      inflater_.next_in = reinterpret_cast<Bytef*>(input_.data());
      inflater_.avail_in = uInt(got);
    }
    const int result = ended_ ? Z_BUF_ERROR : ::inflate(&inflater_, Z_NO_FLUSH);
    ended_ = ended_ || result == Z_STREAM_END;
    return result;
  }

  void unpack(std::span<std::byte> bytes) {
    inflater_.next_out = reinterpret_cast<Bytef*>(bytes.data());
    inflater_.avail_out = uInt(bytes.size());
    while (inflater_.avail_out > 0) {
      const int result = step();
      if (result != Z_OK && result != Z_STREAM_END)
        throw damaged(position_ + bytes.size() - inflater_.avail_out, result == Z_BUF_ERROR);
    }
    if (position_ + bytes.size() == pieceBytes_) verify();
  }

  /// Reads on to the checksum. There must be nothing else before it: damage often unpacks to more.
  void verify() {
    std::byte more{};
    inflater_.next_out = reinterpret_cast<Bytef*>(&more);
    inflater_.avail_out = 1;
    while (!ended_) {
      const int result = step();
      if (inflater_.avail_out == 0)
        throw Error(ErrorCode::badInput, shown(stream_.path()) + ": CompressedData: expected " +
                                             std::to_string(pieceBytes_) + " unpacked bytes, found more");
      if (result != Z_OK && result != Z_STREAM_END) throw damaged(pieceBytes_, result == Z_BUF_ERROR);
    }
  }

  Error damaged(std::uint64_t at, bool early) const {
    return Error(ErrorCode::badInput, shown(stream_.path()) + ": CompressedData: the data " +
                                          (early ? "end early, after " : "are damaged after ") +
                                          std::to_string(at) + " unpacked bytes");
  }

  ByteStream stream_;
  bool packed_, ended_ = false;
  std::uint64_t pieceBytes_;
  std::uint64_t position_ = 0, left_ = 0;
  z_stream inflater_{};
  std::array<std::byte, 1 << 16> input_{};
};

MetaImageStream::MetaImageStream(const MetaImageData& data, Loading& loading)
    : data_(data), loading_(loading) {}
MetaImageStream::~MetaImageStream() = default;

MetaImageStream::File& MetaImageStream::openPiece(std::uint64_t index) {
  if (!piece_ || pieceIndex_ != index) {
    piece_ = std::make_unique<File>(data_, data_.files.at(index));
    pieceIndex_ = index;
  }
  return *piece_;
}

void MetaImageStream::skipTo(std::uint64_t position) {
  position_ = position;
  File& piece = openPiece(position / data_.pieceBytes);
  const std::uint64_t within = position % data_.pieceBytes;
  if (piece.canSeek()) return piece.skip(within - piece.position());
  std::array<std::byte, 1 << 16> scratch;
  while (piece.position() < within) {
    loading_.checkStop();
    const auto some = std::size_t(std::min<std::uint64_t>(within - piece.position(), scratch.size()));
    piece.read(std::span(scratch).first(some));
  }
}

void MetaImageStream::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    File& piece = openPiece(position_ / data_.pieceBytes);
    const auto some =
        std::size_t(std::min<std::uint64_t>(bytes.size(), data_.pieceBytes - position_ % data_.pieceBytes));
    piece.read(bytes.first(some));
    position_ += some;
    bytes = bytes.subspan(some);
  }
}

}  // namespace scolopax::io
