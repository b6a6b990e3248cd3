/* What a library of Windows needs where no C library is linked. Compile it with -fno-builtin: its loops are what they are to replace. */
#include <stddef.h>

int _fltused = 0;

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library;
    (void)reason;
    (void)reserved;
    return 1;
}

void *memcpy(void *to, const void *from, size_t size)
{
    for (size_t k = 0; k < size; k++)
        ((unsigned char *)to)[k] = ((const unsigned char *)from)[k];
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    if (to <= from)
        return memcpy(to, from, size);
    while (size-- > 0)
        ((unsigned char *)to)[size] = ((const unsigned char *)from)[size];
    return to;
}

void *memset(void *to, int value, size_t size)
{
    for (size_t k = 0; k < size; k++)
        ((unsigned char *)to)[k] = (unsigned char)value;
    return to;
}

#if defined(__GNUC__) && defined(__x86_64__)
/* Functions with more than a page of locals call this first, with their size in rax: Windows grows the stack page by page, so that
   every page is to be touched in turn. All registers stay as they are. */
__asm__(".text\n"
        ".globl ___chkstk_ms\n"
        "___chkstk_ms:\n"
        "    pushq %rcx\n"
        "    pushq %rax\n"
        "    leaq 24(%rsp), %rcx\n"
        "    cmpq $0x1000, %rax\n"
        "    jb 2f\n"
        "1:  subq $0x1000, %rcx\n"
        "    testq %rcx, (%rcx)\n"
        "    subq $0x1000, %rax\n"
        "    cmpq $0x1000, %rax\n"
        "    ja 1b\n"
        "2:  subq %rax, %rcx\n"
        "    testq %rcx, (%rcx)\n"
        "    popq %rax\n"
        "    popq %rcx\n"
        "    ret\n");
#endif
