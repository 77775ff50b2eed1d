from .certify import certify as certify, check_installed as check_installed
