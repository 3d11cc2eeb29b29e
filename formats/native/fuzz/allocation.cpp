// The operator new of sanitized programs: it throws std::bad_alloc beyond a limit, as that of a process with limited
// memory does. AddressSanitizer's own ends the process instead, so that a reader could not refuse the file.
#include <cstdlib>
#include <new>

namespace {

constexpr size_t most_bytes = size_t{1} << 28;

void* allocated(size_t size) {
    void* const memory = size <= most_bytes ? std::malloc(size) : nullptr;
    if (!memory) throw std::bad_alloc();
    return memory;
}

void* allocated(size_t size, std::align_val_t alignment) {
    const auto step = static_cast<size_t>(alignment);
    void* const memory = size <= most_bytes ? std::aligned_alloc(step, (size + step - 1) / step * step) : nullptr;
    if (!memory) throw std::bad_alloc();
    return memory;
}

}  // namespace

void* operator new(size_t size) { return allocated(size); }
void* operator new[](size_t size) { return allocated(size); }
void* operator new(size_t size, std::align_val_t alignment) { return allocated(size, alignment); }
void* operator new[](size_t size, std::align_val_t alignment) { return allocated(size, alignment); }
void* operator new(size_t size, const std::nothrow_t&) noexcept {
    return size <= most_bytes ? std::malloc(size) : nullptr;
}
void* operator new[](size_t size, const std::nothrow_t&) noexcept {
    return size <= most_bytes ? std::malloc(size) : nullptr;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
