// SPDX-License-Identifier: Apache-2.0
// How VTK encodes arrays: VTK File Formats (docs.vtk.org), "XML File Formats".
#include "renderer/io/vtk_array.h"

#include <zlib.h>
#if SCOLOPAX_HAS_LZ4
#include <lz4.h>
#endif

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <type_traits>

#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

/// The most bytes that one packed byte can become.
std::uint64_t largestVtkRatio(VtkCompressor compressor) {
  return compressor == VtkCompressor::zlib ? 1032 : compressor == VtkCompressor::lz4 ? 255 : 1;
}

/// The six bits of each character of base64; -1 for others.
constexpr std::array<std::int8_t, 256> kVtkSixBits = [] {
  std::array<std::int8_t, 256> bits{};
  bits.fill(-1);
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kAlphabet.size(); ++i)
    bits[static_cast<unsigned char>(kAlphabet[i])] = std::int8_t(i);
  return bits;
}();

template <class T>
bool parseVtkNumber(std::string_view word, std::byte* to) {
  T value{};
  if constexpr (std::is_floating_point_v<T>) {
    const auto number = parseNumber(word);
    if (!number) return false;
    value = static_cast<T>(*number);
  } else {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) return false;
  }
  std::memcpy(to, &value, sizeof value);
  return true;
}

auto vtkNumberParser(StoredType type) {
  switch (type) {
#define X(name, numpyName, T) \
  case StoredType::name:      \
    return &parseVtkNumber<T>;
    SCOLOPAX_STORED_TYPES(X)
#undef X
  }
  return &parseVtkNumber<double>;
}

void unpackVtkBlock(VtkCompressor compressor, const std::string& where, std::span<const std::byte> packed,
                    std::span<std::byte> block) {
  std::uint64_t got = 0;
  if (compressor == VtkCompressor::zlib) {
    auto size = uLongf(block.size());
    const int result = ::uncompress(reinterpret_cast<Bytef*>(block.data()), &size,
                                    reinterpret_cast<const Bytef*>(packed.data()), uLong(packed.size()));
    got = result == Z_OK ? size : 0;
#if SCOLOPAX_HAS_LZ4
  } else if (packed.size() <= LZ4_MAX_INPUT_SIZE && block.size() <= LZ4_MAX_INPUT_SIZE) {
    const int size =
        LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()),
                            reinterpret_cast<char*>(block.data()), int(packed.size()), int(block.size()));
    got = std::uint64_t(std::max(size, 0));
#endif
  }
  if (got != block.size())
    throw Error(ErrorCode::badInput, where + ": expected a compressed block of " +
                                         std::to_string(block.size()) + " bytes, found damaged data");
}

}  // namespace

std::string VtkArray::where() const { return file + ": array " + inQuotes(name); }

Error badVtk(const std::string& where, const std::string& expected, std::string_view found) {
  return Error(ErrorCode::badInput, where + ": expected " + expected + ", found " + inQuotes(found));
}

Error unsupportedVtk(const std::string& where, const std::string& expected, std::string_view found) {
  return Error(ErrorCode::unsupported, badVtk(where, expected, found).what());
}

void checkVtkArrayFits(const VtkArray& array, std::uint64_t count) {
  const std::uint64_t bytes = array.bits ? count / 8 : saturatingProduct(count, sizeBytes(array.type));
  std::uint64_t held = array.end - std::min(array.begin, array.end);
  // Text has at least a digit and a blank for each number.
  if (array.coding == VtkCoding::ascii) held = saturatingProduct(held / 2 + 1, sizeBytes(array.type));
  if (array.coding == VtkCoding::base64) held = held / 4 * 3 + 3;
  if (array.coding != VtkCoding::ascii) held = saturatingProduct(held, largestVtkRatio(array.compressor));
  if (bytes > held)
    throw Error(ErrorCode::badInput, array.where() + ": " + std::to_string(count) + " numbers need " +
                                         byteCount(bytes) + ", the file holds at most " + byteCount(held));
}

VtkArrayReader::VtkArrayReader(const VtkArray& array, std::uint64_t count, const Loading* loading)
    : array_(array),
      loading_(loading),
      chars_(array.path, array.begin, array.end,
             array.gzip ? ByteStream::Encoding::detect : ByteStream::Encoding::plain) {
  checkVtkArrayFits(array, count);
  if (array.coding != VtkCoding::ascii && array.headerBytes > 0)
    readSizes(saturatingProduct(count, sizeBytes(array.type)));
}

void VtkArrayReader::readSizes(std::uint64_t expectedBytes) {
  const auto check = [&](std::uint64_t found) {
    if (found != expectedBytes)
      throw Error(ErrorCode::badInput,
                  array_.where() + ": expected " + byteCount(expectedBytes) + ", found " + byteCount(found));
  };
  if (array_.compressor == VtkCompressor::none) return check(readSize());
  const std::uint64_t blocks = readSize(), blockBytes = readSize(), lastBytes = readSize();
  const std::uint64_t whole = blocks - std::min<std::uint64_t>(blocks, lastBytes > 0 ? 1 : 0);
  check(saturatingSum(saturatingProduct(whole, blockBytes), blocks > 0 ? lastBytes : 0));
  if (blocks > chars_.left() / array_.headerBytes)
    throw Error(ErrorCode::badInput, array_.where() + ": expected " + std::to_string(blocks) +
                                         " compressed blocks, the file holds only " +
                                         byteCount(chars_.left()));
  if (lastBytes > blockBytes && blocks > 1)
    throw badVtk(array_.where(), "a last block that is not larger than the others",
                 std::to_string(lastBytes));
  if (loading_)
    loading_->checkMemory(array_.where() + ": the sizes of its blocks", saturatingProduct(blocks, 8));
  packedSizes_.reserve(std::size_t(blocks));
  for (std::uint64_t i = 0; i < blocks; ++i) packedSizes_.push_back(readSize());
  blockBytes_ = blocks == 1 ? expectedBytes : blockBytes;
  bytesLeft_ = expectedBytes;
  // The blocks are encoded by themselves.
  tripleAt_ = tripleSize_ = 0;
  padded_ = false;
}

std::uint64_t VtkArrayReader::readSize() {
  std::array<std::byte, 8> bytes{};
  readStored(std::span(bytes).first(array_.headerBytes));
  if (array_.bigEndian) swapBytes(bytes.data(), 1, array_.headerBytes);
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof size);
  return size;
}

void VtkArrayReader::nextTriple() {
  std::uint32_t bits = 0;
  int digits = 0, seen = 0;
  while (seen < 4 && !padded_) {
    const int c = chars_.get();
    if (isVtkBlank(c)) continue;
    const int six = c < 0 ? -1 : kVtkSixBits[std::size_t(c)];
    const bool padding = c == '=' && seen >= 2;
    if (six < 0 && !padding)
      throw badVtk(array_.where(), "base64 data", c < 0 ? "their end" : std::string(1, char(c)));
    if (six >= 0 && digits < seen) throw badVtk(array_.where(), "the end of base64 after \"=\"", "more data");
    bits = bits << 6 | std::uint32_t(std::max(six, 0));
    digits += six >= 0;
    ++seen;
  }
  if (seen < 4) throw badVtk(array_.where(), "base64 data", "their end");
  padded_ = digits < 4;
  tripleSize_ = std::size_t(digits) * 6 / 8;
  tripleAt_ = 0;
  for (std::size_t i = 0; i < 3; ++i) triple_[i] = std::byte(bits >> (16 - 8 * i) & 0xFF);
}

void VtkArrayReader::readStored(std::span<std::byte> bytes) {
  std::size_t done = 0;
  if (array_.coding == VtkCoding::base64) {
    for (; done < bytes.size(); ++done) {
      if (tripleAt_ == tripleSize_) nextTriple();
      bytes[done] = triple_[tripleAt_++];
    }
    return;
  }
  done = chars_.readSome(bytes);
  if (done < bytes.size())
    throw Error(ErrorCode::badInput, array_.where() + ": expected " + std::to_string(bytes.size()) +
                                         " bytes more, found " + std::to_string(done));
}

void VtkArrayReader::nextBlock() {
  const std::uint64_t packed = packedSizes_.at(nextBlock_++), size = std::min(blockBytes_, bytesLeft_);
  if (packed > chars_.left() || size > saturatingProduct(packed, largestVtkRatio(array_.compressor)))
    throw Error(ErrorCode::badInput, array_.where() + ": expected a compressed block of " +
                                         byteCount(packed) + " for " + byteCount(size) + ", the file holds " +
                                         byteCount(chars_.left()) + " more");
  if (loading_) {
    loading_->checkStop();
    loading_->checkMemory(array_.where() + ": a compressed block", saturatingSum(packed, size));
  }
  packed_.resize(std::size_t(packed));
  block_.resize(std::size_t(size));
  readStored(packed_);
  unpackVtkBlock(array_.compressor, array_.where(), packed_, block_);
  blockAt_ = 0;
  bytesLeft_ -= size;
}

void VtkArrayReader::readWords(std::span<std::byte> bytes) {
  const auto parse = vtkNumberParser(array_.type);
  const std::size_t step = sizeBytes(array_.type);
  for (std::size_t at = 0; at < bytes.size(); at += step) {
    const std::string_view word = chars_.word();
    if (parse(word, &bytes[at])) continue;
    throw badVtk(array_.where(), "numbers of type " + std::string(nameOf(array_.type)),
                 word.empty() ? "their end" : word);
  }
}

void VtkArrayReader::readBits(std::span<std::byte> bytes) {
  for (std::byte& value : bytes) {
    if (bitsLeft_ == 0) {
      std::byte next{};
      readStored({&next, 1});
      bitByte_ = unsigned(next);
      bitsLeft_ = 8;
    }
    value = std::byte(bitByte_ >> --bitsLeft_ & 1);
  }
}

void VtkArrayReader::read(std::span<std::byte> bytes) {
  if (array_.coding == VtkCoding::ascii) return readWords(bytes);
  if (array_.bits) return readBits(bytes);
  if (array_.compressor == VtkCompressor::none) return readStored(bytes);
  while (!bytes.empty()) {
    if (blockAt_ == block_.size()) {
      if (nextBlock_ == packedSizes_.size() || bytesLeft_ == 0)
        throw badVtk(array_.where(), "more blocks", "the end");
      nextBlock();
    }
    const std::size_t some = std::min(bytes.size(), block_.size() - blockAt_);
    std::memcpy(bytes.data(), &block_[blockAt_], some);
    blockAt_ += some;
    bytes = bytes.subspan(some);
  }
}

std::vector<double> readVtkNumbers(const VtkArray& array, std::uint64_t count) {
  VtkArrayReader reader(array, count, nullptr);
  const std::size_t size = sizeBytes(array.type);
  std::vector<double> numbers(static_cast<std::size_t>(count));
  for (double& number : numbers) {
    std::array<std::byte, 8> bytes{};
    reader.read(std::span(bytes).first(size));
    if (reader.bigEndian()) swapBytes(bytes.data(), 1, size);
    switch (array.type) {
#define X(name, numpyName, T)                         \
  case StoredType::name: {                            \
    T value;                                          \
    std::memcpy(&value, bytes.data(), sizeof(value)); \
    number = static_cast<double>(value);              \
    break;                                            \
  }
      SCOLOPAX_STORED_TYPES(X)
#undef X
    }
  }
  return numbers;
}

}  // namespace scolopax::io
