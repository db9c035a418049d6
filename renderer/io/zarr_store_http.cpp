// SPDX-License-Identifier: Apache-2.0
// Zarr on a server, by libcurl: only hosts that the user allowed, and limits on bytes and time.
#include <algorithm>
#include <cstring>
#include <mutex>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_store.h"

#if SCOLOPAX_HAS_CURL
#include <curl/curl.h>
#endif

namespace scolopax::io {

#if SCOLOPAX_HAS_CURL
namespace {

struct CurlUrlDeleter {
  void operator()(CURLU* url) const { ::curl_url_cleanup(url); }
};
using CurlUrl = std::unique_ptr<CURLU, CurlUrlDeleter>;

std::string partOf(const CurlUrl& url, CURLUPart part, unsigned flags = 0) {
  char* text = nullptr;
  if (::curl_url_get(url.get(), part, &text, flags) != CURLUE_OK) return "";
  std::string copy(text);
  ::curl_free(text);
  return copy;
}

/// The parts of a URL, by the same parser that makes the request. Throws Error(badInput) unless it is a plain
/// http or https URL without user, query and fragment.
CurlUrl parseZarrUrl(const std::string& text) {
  CurlUrl url(::curl_url());
  const bool parsed = url && ::curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0) == CURLUE_OK;
  const std::string scheme = parsed ? partOf(url, CURLUPART_SCHEME) : "";
  const auto has = [&](CURLUPart part) { return !partOf(url, part).empty(); };
  if ((scheme != "http" && scheme != "https") || has(CURLUPART_USER) || has(CURLUPART_PASSWORD) ||
      has(CURLUPART_QUERY) || has(CURLUPART_FRAGMENT))
    throw Error(ErrorCode::badInput,
                cleanText(text) + ": expected http(s)://HOST/PATH without user, query and fragment");
  return url;
}

/// Whether the list has the host, for the scheme's own port, or "host:port".
bool isAllowed(const CurlUrl& url, const std::vector<std::string>& allowedHosts) {
  const std::string host = lowerCase(partOf(url, CURLUPART_HOST));
  const std::string port = partOf(url, CURLUPART_PORT, CURLU_DEFAULT_PORT);
  const bool isDefault = port == (partOf(url, CURLUPART_SCHEME) == "https" ? "443" : "80");
  return std::ranges::any_of(allowedHosts, [&](const std::string& entry) {
    const std::string allowed = lowerCase(entry);
    return allowed == host + ":" + port || (isDefault && allowed == host);
  });
}

class ZarrHttp : public ZarrStore {
 public:
  ZarrHttp(const std::string& text, const std::vector<std::string>& allowedHosts, std::stop_token stop)
      : ZarrStore(cleanText(text)), allowedHosts_(allowedHosts), stop_(std::move(stop)) {
    static const CURLcode ready = ::curl_global_init(CURL_GLOBAL_DEFAULT);
    const CurlUrl url = parseZarrUrl(text);
    requireAllowed(url);
    base_ = partOf(url, CURLUPART_URL);
    while (base_.ends_with('/')) base_.pop_back();
    handle_.reset(::curl_easy_init());
    if (ready != CURLE_OK || !handle_)
      throw Error(ErrorCode::io, shownKey("") + ": libcurl cannot be started");
  }

  std::optional<std::vector<std::byte>> get(const std::string& key, std::uint64_t most) const override {
    return fetch(key, "", most);
  }

  std::optional<std::vector<std::byte>> getRange(const std::string& key,
                                                 const ZarrRange& range) const override {
    if (range.size == 0) return std::vector<std::byte>();
    const std::string from = range.last ? "" : std::to_string(range.offset);
    const std::string to = std::to_string(range.last ? range.size : range.offset + (range.size - 1));
    auto bytes = fetch(key, from + "-" + to, range.size);
    if (bytes && bytes->size() != range.size)
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected " + std::to_string(range.size) +
                                           " bytes at byte " + std::to_string(range.offset) + ", found " +
                                           std::to_string(bytes->size()));
    return bytes;
  }

  std::vector<std::string> list(const std::string&) const override { return {}; }

 private:
  void requireAllowed(const CurlUrl& url) const {
    if (isAllowed(url, allowedHosts_)) return;
    throw Error(ErrorCode::unsupported, shownKey("") + ": expected a host that --allow-host names, found " +
                                            inQuotes(partOf(url, CURLUPART_HOST) + ":" +
                                                     partOf(url, CURLUPART_PORT, CURLU_DEFAULT_PORT)));
  }

  struct Answer {
    std::vector<std::byte> bytes = {};
    std::uint64_t most = 0;
    bool tooLarge = false;
    CURL* handle = nullptr;
    const std::stop_token* stop = nullptr;
  };

  static std::size_t receive(char* data, std::size_t size, std::size_t count, void* user) {
    auto& answer = *static_cast<Answer*>(user);
    const std::size_t bytes = size * count;
    long status = 0;
    ::curl_easy_getinfo(answer.handle, CURLINFO_RESPONSE_CODE, &status);
    if (status != 200 && status != 206) return bytes;  // the page of an error
    if (bytes > answer.most - answer.bytes.size()) {
      answer.tooLarge = true;
      return 0;
    }
    const std::size_t before = answer.bytes.size();
    answer.bytes.resize(before + bytes);
    std::memcpy(answer.bytes.data() + before, data, bytes);
    return bytes;
  }

  static int checkStop(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    return static_cast<Answer*>(user)->stop->stop_requested() ? 1 : 0;
  }

  std::string urlOf(const std::string& key) const {
    std::string url = base_;
    for (std::string_view rest = key; !rest.empty();) {
      const std::string_view part = rest.substr(0, rest.find('/'));
      rest.remove_prefix(std::min(rest.size(), part.size() + 1));
      char* escaped = ::curl_easy_escape(handle_.get(), part.data(), int(part.size()));
      url += "/";
      url += escaped ? escaped : "";
      ::curl_free(escaped);
    }
    return url;
  }

  void prepare(const std::string& url, const std::string& range, Answer& answer) const {
    CURL* handle = handle_.get();
    constexpr long kConnectSeconds = 10, kIdleSeconds = 30, kSeconds = 300;
    ::curl_easy_reset(handle);
    ::curl_easy_setopt(handle, CURLOPT_URL, url.c_str());
    ::curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    ::curl_easy_setopt(handle, CURLOPT_FOLLOWLOCATION, 0L);
    ::curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    ::curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
    ::curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, 1L);
    ::curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME, kIdleSeconds);
    ::curl_easy_setopt(handle, CURLOPT_TIMEOUT, kSeconds);
    ::curl_easy_setopt(handle, CURLOPT_USERAGENT, "scolopax");
    if (!range.empty()) ::curl_easy_setopt(handle, CURLOPT_RANGE, range.c_str());
    ::curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, &ZarrHttp::receive);
    ::curl_easy_setopt(handle, CURLOPT_WRITEDATA, &answer);
    ::curl_easy_setopt(handle, CURLOPT_NOPROGRESS, 0L);
    ::curl_easy_setopt(handle, CURLOPT_XFERINFOFUNCTION, &ZarrHttp::checkStop);
    ::curl_easy_setopt(handle, CURLOPT_XFERINFODATA, &answer);
  }

  /// Bytes that the server has for a key, or none. A redirection is followed on the same host only.
  std::optional<std::vector<std::byte>> fetch(const std::string& key, const std::string& range,
                                              std::uint64_t most) const {
    constexpr int kMostRedirections = 4;
    const std::lock_guard lock(mutex_);
    std::string url = urlOf(key);
    for (int redirections = 0; redirections <= kMostRedirections; ++redirections) {
      Answer answer{.most = most, .handle = handle_.get(), .stop = &stop_};
      prepare(url, range, answer);
      const CURLcode result = ::curl_easy_perform(handle_.get());
      if (answer.tooLarge)
        throw Error(ErrorCode::tooLarge, shownKey(key) + ": expected at most " + std::to_string(most) +
                                             " bytes, found more" +
                                             (range.empty() ? "" : "; the server may not know byte ranges"));
      if (result == CURLE_ABORTED_BY_CALLBACK)
        throw Error(ErrorCode::cancelled, shownKey(key) + ": cancelled");
      if (result != CURLE_OK)
        throw Error(ErrorCode::io, shownKey(key) + ": cannot be read: " + ::curl_easy_strerror(result));
      long status = 0;
      ::curl_easy_getinfo(handle_.get(), CURLINFO_RESPONSE_CODE, &status);
      if (status == (range.empty() ? 200 : 206)) return std::move(answer.bytes);
      if (status == 404 || status == 410) return std::nullopt;
      if (status < 300 || status >= 400) refuseStatus(key, range, status);
      url = redirectedUrl(key, url);
    }
    throw Error(ErrorCode::io, shownKey(key) + ": expected at most " + std::to_string(kMostRedirections) +
                                   " redirections, found more");
  }

  [[noreturn]] void refuseStatus(const std::string& key, const std::string& range, long status) const {
    if (status == 416)
      throw Error(ErrorCode::badInput, shownKey(key) + ": expected bytes " + range + ", found fewer");
    throw Error(ErrorCode::io, shownKey(key) + ": expected the status " + (range.empty() ? "200" : "206") +
                                   ", found " + std::to_string(status));
  }

  std::string redirectedUrl(const std::string& key, const std::string& from) const {
    const char* to = nullptr;
    ::curl_easy_getinfo(handle_.get(), CURLINFO_REDIRECT_URL, &to);
    if (!to)
      throw Error(ErrorCode::io, shownKey(key) + ": expected where a redirection leads, found nothing");
    const std::string target = to;
    const CurlUrl old = parseZarrUrl(from), url = parseZarrUrl(target);
    if (partOf(old, CURLUPART_HOST) != partOf(url, CURLUPART_HOST))
      throw Error(ErrorCode::unsupported, shownKey(key) +
                                              ": expected no redirection to another host, found " +
                                              inQuotes(partOf(url, CURLUPART_HOST)));
    requireAllowed(url);
    return target;
  }

  struct EasyDeleter {
    void operator()(CURL* handle) const { ::curl_easy_cleanup(handle); }
  };
  std::vector<std::string> allowedHosts_;
  std::stop_token stop_;
  std::string base_;
  std::unique_ptr<CURL, EasyDeleter> handle_;
  mutable std::mutex mutex_;  ///< one request at a time, which keeps the connection
};

}  // namespace

std::unique_ptr<ZarrStore> openZarrHttp(const std::string& url, const std::vector<std::string>& allowedHosts,
                                        std::stop_token stop) {
  return std::make_unique<ZarrHttp>(url, allowedHosts, std::move(stop));
}
#else
std::unique_ptr<ZarrStore> openZarrHttp(const std::string& url, const std::vector<std::string>&,
                                        std::stop_token) {
  throw Error(ErrorCode::unsupported, cleanText(url) +
                                          ": reading by HTTP needs the library of " SCOLOPAX_LACKS_CURL
                                          ", without which this program was built");
}
#endif

}  // namespace scolopax::io
