// Stands in for libFuzzer where the compiler has none: changes files of a corpus by chance, without knowing which code
// they reach. It takes the options of libFuzzer that tools/fuzz_native.sh gives, and ignores all others.
//
// Usage: PROGRAM [-max_total_time=SECONDS] [-seed=N] [-artifact_prefix=FOLDER/] CORPUS_FOLDER or FILE ...
// Files are run as they are.
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
extern "C" __attribute__((weak)) int LLVMFuzzerInitialize(int* count, char*** words);

namespace {

using Bytes = std::vector<uint8_t>;
namespace fs = std::filesystem;

constexpr unsigned seconds_for_one = 20;
Bytes current;
std::string artifact_prefix;

void keep() {
    const std::string name = artifact_prefix + "crash";
    std::ofstream(name, std::ios::binary).write(reinterpret_cast<const char*>(current.data()), current.size());
    std::fprintf(stderr, "the file is kept as %s\n", name.c_str());
}

void run(Bytes data) {
    current = std::move(data);
    alarm(seconds_for_one);  // a hang ends by SIGALRM
    LLVMFuzzerTestOneInput(current.data(), current.size());
    alarm(0);
}

Bytes read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(file), {});
}

void change(Bytes& data, std::mt19937_64& chance) {
    const auto below = [&](size_t limit) { return limit == 0 ? 0 : chance() % limit; };
    const size_t end = chance() % 2 == 0 ? std::min<size_t>(data.size(), 1024) : data.size();
    const size_t at = below(end), count = std::min<size_t>(below(16) + 1, data.size() - at);
    switch (chance() % 5) {
        case 0:
            if (!data.empty()) data[at] ^= static_cast<uint8_t>(1U << chance() % 8);
            break;
        case 1:
            std::fill_n(data.begin() + at, count, chance() % 2 == 0 ? 0xFF : 0);
            break;
        case 2:
            data.erase(data.begin() + at, data.begin() + at + count);
            break;
        case 3: {
            const Bytes part(data.begin() + at, data.begin() + at + count);
            data.insert(data.begin() + below(data.size() + 1), part.begin(), part.end());
            break;
        }
        default:
            data.resize(at);
    }
}

}  // namespace

int main(int argc, char** argv) {
    double seconds = 60.0;
    uint64_t seed = std::random_device{}();
    std::vector<Bytes> corpus;
    if (LLVMFuzzerInitialize) LLVMFuzzerInitialize(&argc, &argv);
    __sanitizer_set_death_callback(keep);
    for (const int signal_number : {SIGABRT, SIGALRM})
        signal(signal_number, [](int) {
            keep();
            _exit(77);
        });
    for (int k = 1; k < argc; ++k) {
        const std::string word = argv[k];
        const std::string value = word.substr(word.find('=') + 1);
        if (word.starts_with("-max_total_time=")) seconds = std::stod(value);
        if (word.starts_with("-seed=")) seed = std::stoull(value);
        if (word.starts_with("-artifact_prefix=")) artifact_prefix = value;
        if (word.starts_with("-")) continue;
        if (!fs::is_directory(word)) {
            run(read(word));
            seconds = 0;
            continue;
        }
        for (const auto& entry : fs::directory_iterator(word)) corpus.push_back(read(entry.path()));
    }
    uint64_t runs = 0;
    for (const Bytes& file : corpus) run(file);
    std::mt19937_64 chance(seed);
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    for (; !corpus.empty() && std::chrono::steady_clock::now() < end; ++runs) {
        Bytes data = corpus[chance() % corpus.size()];
        for (uint64_t left = chance() % 4 + 1; left > 0; --left) change(data, chance);
        run(std::move(data));
    }
    std::printf("%llu runs, seed %llu\n", static_cast<unsigned long long>(runs), static_cast<unsigned long long>(seed));
    return 0;
}
